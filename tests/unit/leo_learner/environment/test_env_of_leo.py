# SPDX-License-Identifier: Apache-2.0
"""LEO as a gymnasium environment."""

import numpy as np
import pytest

from leo_learner.environment.env import ModelEnv
from leo_sim.model import Model


@pytest.fixture(scope='module', params=['leo', 'leo_ode'])
def env(request):
    return ModelEnv(Model(request.param, engine='mujoco'))


def test_random_voltages_make_it_fall(env):
    env.action_space.seed(0)
    ends = []
    for seed in range(5):
        seen, _ = env.reset(seed=seed)
        assert seen.shape == env.observation_space.shape == (14,)
        fallen, rewards = False, []
        while not fallen:
            seen, reward, fallen, over, _ = env.step(env.action_space.sample())
            rewards.append(reward)
            assert np.isfinite([*seen, reward]).all()
            assert not over
        assert rewards[-1] < -70
        ends.append(len(rewards))
    assert min(ends) > 3


def test_an_episode_is_as_long_as_in_the_thesis(env):
    assert env.episode_steps == {'leo': 667, 'leo_ode': 833}[env.robot.name]


def test_the_same_seed_and_voltages_give_the_same_episode(env):
    volts = np.random.default_rng(1).uniform(-8.6, 8.6, (10, 6))
    runs = []
    for _ in range(2):
        first, _ = env.reset(seed=3)
        runs.append([first.tolist(), *(env.step(u)[:2] for u in volts)])
    assert runs[0][0] == runs[1][0]
    for one, other in zip(runs[0][1:], runs[1][1:], strict=True):
        assert one[0].tolist() == other[0].tolist()
        assert one[1] == other[1]


def test_the_stance_foot_is_forgotten_between_episodes():
    env = ModelEnv(Model('leo_ode', engine='mujoco'))
    firsts = []
    for push in (np.full(6, 8.0), np.full(6, -8.0)):
        env.reset(options={'pose': 'nominal'})
        firsts.append(env.step(np.zeros(6))[1])
        for _ in range(20):
            env.step(push)
    assert firsts[0] == firsts[1]
