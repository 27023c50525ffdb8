# SPDX-License-Identifier: Apache-2.0
"""Small environments and agents that learn on them."""

from dataclasses import replace

import gymnasium
import numpy as np
import torch

from leo_lab.thesis.sarsa import Config
from leo_learner.ddpg.configs import RECOMMENDED
from leo_learner.training.loop import TrainingLoop

SMALL = replace(RECOMMENDED, hidden=(32, 32), warm_up=64, test_interval=2, test_starts=2)
"""Of DDPG."""
FEW_TILES = Config(
    levels=3, tilings=8, widths=(0.2, 1.5), memory=2**12, gamma=0.98, trace=0.8, test_interval=5
)
"""Of SARSA."""


class OneNumber(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-1, 1, (1,), np.float64)
    action_space = gymnasium.spaces.Box(-2.0, 2.0, (1,), np.float64)


class Follow(OneNumber):
    """Ten steps; the best action is minus the observation."""

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps, self._seen = 0, self.np_random.uniform(-1, 1, 1)
        return self._seen, {}

    def step(self, action):
        reward = -float((action[0] / 2 + self._seen[0]) ** 2)
        self.steps += 1
        self._seen = self.np_random.uniform(-1, 1, 1)
        return self._seen, reward, False, self.steps == 10, {}


class Corridor(OneNumber):
    """Steps of 0.1 at most to the exit at 1; every step costs 1, 50 steps are too many."""

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        nominal = (options or {}).get('pose') == 'nominal'
        self.steps, self._at = 0, 0.0 if nominal else self.np_random.uniform(-0.5, 0.5)
        return np.array([self._at]), {}

    def step(self, action):
        self.steps += 1
        self._at = max(-1.0, self._at + 0.05 * float(action[0]))
        return np.array([self._at]), -1.0, self._at > 0.99, self.steps == 50, {}


def same(one: TrainingLoop, other: TrainingLoop) -> bool:
    found, known = one.tensors(), other.tensors()
    assert found.keys() == known.keys()
    return all(torch.equal(found[name], known[name]) for name in found)
