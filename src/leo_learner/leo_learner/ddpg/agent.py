# SPDX-License-Identifier: Apache-2.0
"""Deep deterministic policy gradient as in Rastogi's thesis (2017), chapters 2, 5 and 7.

From top to bottom: networks, exploration noise, the agent (act, learn), and what it does in the
training loop. The update is in `fast_update`, the numbers are in `configs`.
"""

from collections.abc import Callable, Mapping
import copy
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
import torch
from torch import nn, Tensor

from leo_learner.ddpg.configs import Config
from leo_learner.ddpg.fast_update import FastUpdate, Layers
from leo_learner.training.loop import TrainingLoop
from leo_learner.training.replay import Batch, Replay, Transition

OBSERVATION_SCALE = 'observation_scale'
SCALES = (OBSERVATION_SCALE, 'reward_scale')
MODULES = ('actor', 'critic', 'target_actor', 'target_critic')
OPTIMISERS = ('actor_adam', 'critic_adam')


Update = Callable[['Agent'], Any]


def hidden_layers(sizes: list[int], extra_at_last: int, layer_norm: bool) -> nn.ModuleList:
    """Hidden layers, weights U(+-1/sqrt(fan in)), biases zero; the last one takes the action."""
    layers = nn.ModuleList()
    for i, (n_in, n_out) in enumerate(pairwise(sizes)):
        linear = nn.Linear(n_in + (extra_at_last if i == len(sizes) - 2 else 0), n_out)
        bound = linear.in_features**-0.5
        nn.init.uniform_(linear.weight, -bound, bound)
        nn.init.zeros_(linear.bias)
        norm = [nn.LayerNorm(n_out)] if layer_norm else []
        layers.append(nn.Sequential(linear, *norm, nn.ReLU()))
    return layers


def output_layer(n_in: int, n_out: int) -> nn.Linear:
    """Linear, weights U(+-0.003), bias zero."""
    layer = nn.Linear(n_in, n_out)
    nn.init.uniform_(layer.weight, -3e-3, 3e-3)
    nn.init.zeros_(layer.bias)
    return layer


class Actor(nn.Module):
    """Policy: scaled observation (B, n_obs) -> action (B, n_act) in [-1, 1]."""

    def __init__(self, n_obs: int, n_act: int, config: Config) -> None:
        super().__init__()
        self.hidden = hidden_layers([n_obs, *config.hidden], 0, config.layer_norm)
        self.output = output_layer(config.hidden[-1], n_act)

    def forward(self, observation: Tensor) -> Tensor:
        for layer in self.hidden:
            observation = layer(observation)
        return torch.tanh(self.output(observation))


class Critic(nn.Module):
    """Value: (B, n_obs), (B, n_act) -> (B,). The action enters at the last hidden layer."""

    def __init__(self, n_obs: int, n_act: int, config: Config) -> None:
        super().__init__()
        self.hidden = hidden_layers([n_obs, *config.hidden], n_act, config.layer_norm)
        self.output = output_layer(config.hidden[-1], 1)

    def forward(self, observation: Tensor, action: Tensor) -> Tensor:
        for layer in self.hidden[:-1]:
            observation = layer(observation)
        last = self.hidden[-1](torch.cat([observation, action], dim=1))
        return self.output(last).squeeze(1)


class Critics(nn.Module):
    """One critic, or two that start apart: (B, n_obs), (B, n_act) -> (C, B)."""

    def __init__(self, n_obs: int, n_act: int, config: Config) -> None:
        super().__init__()
        count = 2 if config.twin_critics else 1
        self.members = nn.ModuleList(Critic(n_obs, n_act, config) for _ in range(count))

    def forward(self, observation: Tensor, action: Tensor) -> Tensor:
        return torch.stack([critic(observation, action) for critic in self.members])


class OrnsteinUhlenbeck:
    """Exploration noise n <- n - theta n + sigma N(0, 1) per step, zero at the episode's start."""

    def __init__(self, size: int, theta: float, sigma: float, rng: np.random.Generator) -> None:
        self._theta, self._sigma, self._rng = theta, sigma, rng
        self._value = np.zeros(size)

    def __call__(self) -> np.ndarray:
        drawn = self._rng.normal(size=self._value.shape)
        self._value += -self._theta * self._value + self._sigma * drawn
        return self._value.copy()


class Agent:
    """The networks, their targets and optimisers: everything that learning changes.

    `seed` is that of the first weights, `update` makes what computes an update.
    """

    def __init__(
        self, n_obs: int, n_act: int, config: Config, seed: int, update: Update = FastUpdate
    ) -> None:
        torch.set_num_threads(1)
        self.config = config
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            self.actor = Actor(n_obs, n_act, config)
            self.critic = Critics(n_obs, n_act, config)
        self.target_actor = copy.deepcopy(self.actor).requires_grad_(False)
        self.target_critic = copy.deepcopy(self.critic).requires_grad_(False)
        self.observation_scale = torch.ones(n_obs)
        self.reward_scale = torch.ones(())
        self.update = update(self)
        self._policy = Layers(self.actor)

    def act(self, observation: np.ndarray) -> np.ndarray:
        """The policy's action in [-1, 1] for one unscaled observation (n_obs,)."""
        seen = observation.astype(np.float32) * self.observation_scale.numpy()
        action: np.ndarray = np.tanh(self._policy.forward(seen[None]))[0]
        return action

    @property
    def scaled(self) -> bool:
        return bool((self.observation_scale != 1).any())

    def fit_scale(self, warm_up: Batch) -> None:
        """Freeze the scales at one over the spread of what the warm-up saw."""
        spread = np.maximum(warm_up.observations.std(axis=0), 1e-3)
        self.observation_scale = torch.from_numpy(1 / spread)
        self.reward_scale = torch.tensor(1 / max(float(warm_up.rewards.std()), 1e-3))

    def learn(self, batch: Batch) -> dict[str, float]:
        """One update on a batch of unscaled transitions; the losses and the mean value."""
        scale = self.observation_scale.numpy()
        scaled = batch._replace(
            observations=batch.observations * scale,
            next_observations=batch.next_observations * scale,
            rewards=batch.rewards * self.reward_scale.numpy(),
        )
        torch.set_flush_denormal(True)  # faster; the physics in the same process keeps its bits
        try:
            return self.update(scaled)
        finally:
            torch.set_flush_denormal(False)

    def tensors(self) -> dict[str, Tensor]:
        tensors = {name: getattr(self, name) for name in SCALES}
        for module in MODULES:
            state = getattr(self, module).state_dict()
            tensors |= {f'{module}/{name}': t for name, t in state.items()}
        for optimiser in OPTIMISERS:
            for number, state in getattr(self.update, optimiser).state_dict()['state'].items():
                tensors |= {f'{optimiser}/{number}/{key}': t for key, t in state.items()}
        return {name: t.contiguous() for name, t in tensors.items()}

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """The reverse of `tensors`, for an agent of the same configuration."""
        for name in SCALES:
            setattr(self, name, tensors[name].clone())
        for module in MODULES:
            getattr(self, module).load_state_dict(part(tensors, f'{module}/'))
        for optimiser in OPTIMISERS:
            _load_optimiser(getattr(self.update, optimiser), part(tensors, f'{optimiser}/'))


def _load_optimiser(optimiser: Any, tensors: Mapping[str, Tensor]) -> None:
    state: dict[int, dict[str, Tensor]] = {}
    for path, tensor in tensors.items():
        number, key = path.split('/')
        state.setdefault(int(number), {})[key] = tensor
    groups = optimiser.state_dict()['param_groups']
    optimiser.load_state_dict({'state': state, 'param_groups': groups})


def part(tensors: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """The tensors whose names begin with `prefix`, by what follows it."""
    return {n.removeprefix(prefix): t for n, t in tensors.items() if n.startswith(prefix)}


class Training(TrainingLoop):
    """DDPG on an environment, with `THESIS` or a variation of it (see `configs`)."""

    agent_name = 'ddpg'
    config: Config
    agent: Agent
    replay: Replay

    def __init__(self, env: gymnasium.Env, config: Config, seed: int) -> None:
        super().__init__(env, config, seed)
        n_obs, n_act = self.sizes
        self.agent = Agent(n_obs, n_act, config, seed)
        self.replay = Replay(config.replay, n_obs, n_act)
        self.keep()

    def tensors(self) -> dict[str, Tensor]:
        return self.agent.tensors() | {f'best_actor/{n}': t for n, t in self.best.items()}

    def load_tensors(self, tensors: Mapping[str, Tensor]) -> None:
        self.agent.load(tensors)
        scale = {OBSERVATION_SCALE: self.agent.observation_scale}
        self.best = scale | part(tensors, 'best_actor/')

    def _begin(self, rng: np.random.Generator) -> None:
        config, self._rng, size = self.config, rng, len(self.limit)
        self._noise = OrnsteinUhlenbeck(size, config.noise_theta, config.noise_sigma, rng)

    def _explore(self, observation: np.ndarray) -> np.ndarray:
        return np.clip(self.agent.act(observation) + self._noise(), -1, 1)

    def _learn(self, transition: Transition) -> dict[str, Any]:
        self.replay.add(transition)
        if len(self.replay) < max(self.config.warm_up, self.config.batch):
            return {}
        if self.config.scale and not self.agent.scaled:
            self.agent.fit_scale(self.replay.all())
        return self.agent.learn(self.replay.sample(self.config.batch, self._rng))

    def keep(self) -> None:
        scale = self.agent.observation_scale.clone()
        self.best = copy.deepcopy(self.agent.actor.state_dict()) | {OBSERVATION_SCALE: scale}
