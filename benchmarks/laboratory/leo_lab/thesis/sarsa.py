# SPDX-License-Identifier: Apache-2.0
"""SARSA(lambda) with tile coding, the baseline of the thesis' Table 3 (docs/reference/leo.md 8).

Every episode draws its start and its exploration from a generator seeded with (seed, episode).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
import math

import gymnasium
import numpy as np
import torch
from torch import Tensor

from leo_lab.thesis.tile_coding import add, TileCoding
from leo_learner.training.loop import Act, LoopConfig, TrainingLoop
from leo_learner.training.replay import Transition
from leo_msgs_py.errors import UserError

FAINT = 1e-3  # traces below this are dropped


@dataclass(frozen=True)
class Config(LoopConfig):
    """All numbers of a training run; the defaults are the data sheet's, for Sym."""

    alpha: float = 0.2  # learning rate; alpha times the error is added to each tiling's weight
    gamma: float = 0.9962  # discount per control step
    trace: float = 0.8582  # lambda: an accumulating trace keeps gamma lambda per step
    epsilon: float = 0.05  # share of actions drawn from all of them
    levels: int = 7  # of each actuator, uniform from one limit to the other
    tilings: int = 16  # over observation and action
    widths: tuple[float, ...] = (*4 * (0.28,), 0.14, *4 * (10.0,), 5.0, *3 * (5.33,))
    """Of a tile [rad, rad/s, V]: those of `sym.OBSERVED`, then the voltages."""
    memory: int = 33_554_432  # cells for weights, a power of two
    initial: float = 0.01  # weights start as U(0, initial)


class Agent:
    """The tiles and what they say about the actions, up to `limit` (A,).

    UserError where the tiles of `config` are for other observations and actions.
    """

    def __init__(self, n_obs: int, limit: np.ndarray, config: Config, seed: int) -> None:
        if len(config.widths) != n_obs + len(limit):
            raise UserError(
                f'SARSA has tiles over {len(config.widths)} numbers, here are {n_obs} observed '
                f'and {len(limit)} actuators; use it with the actions sym of a LEO robot'
            )
        levels = np.linspace(-1, 1, config.levels)
        self.actions = np.array(list(product(levels, repeat=len(limit))))
        widths, sizes = np.array(config.widths), (config.tilings, config.memory, config.initial)
        self.tiles = TileCoding(widths, self.actions * limit, *sizes, seed)

    def act(self, observation: np.ndarray) -> np.ndarray:
        """The best action in [-1, 1], of equal ones the first; (..., n_obs) -> (..., A)."""
        values = np.apply_along_axis(self.tiles.values, -1, observation)
        return self.actions[values.argmax(axis=-1)]

    def tensors(self) -> dict[str, Tensor]:
        """All weights that have learned."""
        return {name: torch.from_numpy(a) for name, a in self.tiles.claimed().items()}

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        self.tiles.restore({name: tensor.numpy() for name, tensor in tensors.items()})


class Training(TrainingLoop):
    """SARSA(lambda) on an environment; UserError as `Agent`."""

    agent_name = 'sarsa'
    config: Config
    agent: Agent

    def __init__(self, env: gymnasium.Env, config: Config, seed: int) -> None:
        super().__init__(env, config, seed)
        self.agent = Agent(self.sizes[0], self.limit, config, seed)
        self._decay = config.gamma * config.trace
        kept = math.ceil(math.log(FAINT, self._decay)) if self._decay else 1
        self._traces = np.zeros((kept, config.tilings), np.int64)
        self.keep()

    def tensors(self) -> dict[str, Tensor]:
        parts = {'present': self.agent.tensors(), 'best': self.best}
        return {f'{kind}/{n}': t for kind, part in parts.items() for n, t in part.items()}

    def load_tensors(self, tensors: Mapping[str, Tensor]) -> None:
        names = self.best
        self.agent.load({name: tensors[f'present/{name}'] for name in names})
        self.best = {name: tensors[f'best/{name}'] for name in names}

    def _begin(self, rng: np.random.Generator) -> None:
        self._rng, self._traced = rng, 0
        self._choice: int | None = None

    def _explore(self, observation: np.ndarray) -> np.ndarray:
        if self._choice is None:
            self._choice = self._chosen(self.agent.tiles.values(observation))
        return self.agent.actions[self._choice]

    def _learn(self, transition: Transition) -> dict[str, float]:
        assert self._choice is not None
        tiles, ahead = self.agent.tiles, 0.0
        cells = tiles.claim(transition.observation, self._choice)
        if not transition.terminated:
            values = tiles.values(transition.following)
            self._choice = self._chosen(values)
            ahead = float(values[self._choice])
        value = float(tiles.weights[cells].mean())
        error = transition.reward + self.config.gamma * ahead - value
        self._traces[self._traced % len(self._traces)] = cells
        self._traced += 1
        add(tiles.weights, self._traces, self._traced, self.config.alpha * error, self._decay)
        return {'losses/qf_loss': error**2, 'losses/qf_values': value}

    def keep(self) -> None:
        self.best = self.agent.tensors()

    def best_act(self) -> Act:
        """The best policy by test; the agent is put back to it."""
        self.agent.load(self.best)
        return lambda seen: self.agent.act(seen) * self.limit

    def _chosen(self, values: np.ndarray) -> int:
        """Epsilon-greedy; of equal values the first."""
        if self._rng.random() < self.config.epsilon:
            return int(self._rng.integers(len(values)))
        return int(np.argmax(values))
