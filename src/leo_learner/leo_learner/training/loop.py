# SPDX-License-Identifier: Apache-2.0
"""The training loop every agent shares: episodes, a test now and then, the best policy kept.

Every episode draws its start, its exploration and its batches from generators seeded with (seed,
episode), so a run that was stopped between two episodes goes on exactly as if it had not been.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
import time
from typing import Any, ClassVar, Protocol

import gymnasium
from gymnasium.spaces import Box
import numpy as np
from torch import Tensor

from leo_learner.training.replay import Replay, Transition

Act = Callable[[np.ndarray], np.ndarray]
"""Observation (n_obs,) -> input [V, N m or rad] (A,), as `Policy` is one."""
OnScalar = Callable[[str, float, int], None]
"""Receives (name, value, step): TensorBoard's `add_scalar`, a progress bar, a test."""


@dataclass(frozen=True)
class LoopConfig:
    episode_steps: int | None = None
    """Training episodes are cut there, for more starts; a cut bootstraps."""
    test_interval: int = 10  # training episodes between two tests
    test_steps: int | None = None
    """Transitions between two tests, in place of `test_interval`: a test of a robot that has
    learned to stand still lasts as long as the training of many short falls."""
    test_starts: int = 1  # per test: the nominal one (the thesis'), then fixed random ones


class Agent(Protocol):
    def act(self, observation: np.ndarray) -> np.ndarray:
        """The present policy's action in [-1, 1], without exploration."""


class TrainingLoop(ABC):
    """Episodes on an environment; what an agent does in them is in its subclass.

    Observations are as the policy sees them, actions in volts (or N m); `reset` takes
    `options={'pose': 'nominal' | 'random'}`.
    """

    agent_name: ClassVar[str]  # as the policy file has it
    agent: Agent
    best: dict[str, Tensor]  # what a policy file holds of the best policy by test
    replay: Replay | None = None

    def __init__(self, env: gymnasium.Env, config: LoopConfig, seed: int) -> None:
        assert isinstance(env.observation_space, Box) and isinstance(env.action_space, Box)
        self.env, self.config, self.seed = env, config, seed
        self.limit: np.ndarray = env.action_space.high
        self.sizes = env.observation_space.shape[0], env.action_space.shape[0]
        self.steps = self.episodes = 0
        self.tested = -1  # steps after which the policy was last tested
        self.best_return = -np.inf
        self.stop = False

    @abstractmethod
    def tensors(self) -> dict[str, Tensor]:
        """Every number learning has changed, by name, the best policy's too."""

    @abstractmethod
    def load_tensors(self, tensors: Mapping[str, Tensor]) -> None:
        """The reverse of `tensors`, for a run of the same configuration."""

    @abstractmethod
    def _begin(self, rng: np.random.Generator) -> None:
        """Begin an episode, with all that is drawn in it from `rng`."""

    @abstractmethod
    def _explore(self, observation: np.ndarray) -> np.ndarray:
        """The action in [-1, 1] to take in training."""

    @abstractmethod
    def _learn(self, transition: Transition) -> Mapping[str, Any]:
        """Learn from what came of it; returns what to log of it."""

    @abstractmethod
    def keep(self) -> None:
        """The present policy counts as the best one now."""

    def run(
        self,
        steps: int,
        on_scalar: OnScalar = lambda name, value, step: None,
        between: Callable[[], None] = lambda: None,
    ) -> bool:
        """Whole episodes until `steps` transitions were gathered or `stop` is set.

        Returns whether they were gathered and what was learned was tested. `between` is called
        after every episode and its test: the moment to save.
        """
        while self.steps < steps and not self.stop:
            before = self.steps
            self._train_episode(on_scalar)
            if self._test_due(before):
                self._keep_best(on_scalar)
            between()
        if not self.stop and self.tested != self.steps:
            self._keep_best(on_scalar)
        return self.tested == self.steps >= steps

    def test(self, starts: int) -> np.ndarray:
        """Returns (starts,) of the present policy without noise; nothing is learned or stored."""
        return play(self.env, lambda seen: self.agent.act(seen) * self.limit, starts)

    def _train_episode(self, on_scalar: OnScalar) -> None:
        rng = np.random.default_rng([self.seed, self.episodes])
        began, first = time.perf_counter(), self.steps
        self._begin(rng)
        observation, _ = self.env.reset(seed=int(rng.integers(2**31)), options={'pose': 'random'})
        total, done = 0.0, False
        logged: dict[str, Any] = {}
        while not done:
            action = self._explore(observation)
            following, reward, terminated, truncated, info = self.env.step(action * self.limit)
            if 'lost' in info:
                break
            total, self.steps = total + float(reward), self.steps + 1
            logged |= self._learn(
                Transition(observation, action, float(reward), following, terminated)
            )
            cut = self.steps - first == self.config.episode_steps
            observation, done = following, terminated or truncated or cut
        self.episodes += 1
        speed = (self.steps - first) / (time.perf_counter() - began)
        report = {'charts/episodic_return': total, 'charts/SPS': speed, **logged}
        for name, value in report.items():
            on_scalar(name, float(value), self.steps)

    def _test_due(self, before: int) -> bool:
        """Whether the episode that began after `before` transitions is followed by a test."""
        period = self.config.test_steps
        if period is None:
            return self.episodes % self.config.test_interval == 0
        return self.steps // period > before // period

    def _keep_best(self, on_scalar: OnScalar) -> None:
        result = float(self.test(self.config.test_starts).mean())
        on_scalar('charts/test_return', result, self.steps)
        self.tested = self.steps
        if result > self.best_return:
            self.best_return = result
            self.keep()


def play(
    env: gymnasium.Env,
    act: Act,
    episodes: int,
    seed: int = 0,
    on_episode: Callable[[], None] = lambda: None,
) -> np.ndarray:
    """Returns of `episodes` episodes without noise: the nominal start, then random ones.

    An episode that was lost to a restart of the robot is played again; `on_episode` is called
    after each that counts.
    """
    returns: list[float] = []
    while len(returns) < episodes:
        number = len(returns)
        total, lost = run_episode(env, act, seed + number, 'random' if number else 'nominal')
        if not lost:
            returns.append(total)
            on_episode()
    return np.array(returns)


def run_episode(
    env: gymnasium.Env, act: Act, seed: int, pose: str, go_on: Callable[[], bool] = lambda: True
) -> tuple[float, bool]:
    observation, _ = env.reset(seed=seed, options={'pose': pose})
    total, done = 0.0, False
    while not done:
        observation, reward, terminated, truncated, info = env.step(act(observation))
        if 'lost' in info:
            return total, True
        total += float(reward)
        done = terminated or truncated or not go_on()
    return total, False
