# SPDX-License-Identifier: Apache-2.0
"""SARSA(lambda): the data sheet's numbers, its update by hand, learning, runs that go on."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from tests.agents import Corridor, FEW_TILES

from leo_lab.thesis.sarsa import Agent, Config, Training
from leo_learner.environment.env import ModelEnv
from leo_learner.environment.sym import Sym
from leo_learner.training.loop import play
from leo_learner.training.replay import Transition
from leo_msgs_py.errors import UserError
from leo_sim.model import Model


def test_numbers_of_the_data_sheet():
    agent = Agent(10, np.full(3, 8.6), replace(Config(), memory=2**10), seed=0)
    assert agent.actions.shape == (343, 3)
    assert np.diff(agent.actions[:7, 2] * 8.6) == pytest.approx(2 * 8.6 / 6)
    assert Config().widths == (0.28, 0.28, 0.28, 0.28, 0.14, 10, 10, 10, 10, 5, 5.33, 5.33, 5.33)
    wanted = {'alpha': 0.2, 'gamma': 0.9962, 'trace': 0.8582, 'epsilon': 0.05, 'tilings': 16}
    wanted |= {'memory': 33_554_432, 'initial': 0.01, 'test_interval': 10}
    assert wanted.items() <= asdict(Config()).items()


def test_update_by_hand():
    """Accumulating traces over a dense vector of weights, as in Sutton and Barto."""
    config = replace(FEW_TILES, epsilon=1.0)
    training, trace = Training(Corridor(), config, seed=3), np.zeros(FEW_TILES.memory)
    tiles, rng = training.agent.tiles, np.random.default_rng(0)
    training._begin(np.random.default_rng(0))
    at = rng.uniform(-0.1, 0.1, (7, 1))
    training._explore(at[0])
    dense = {}
    for k in range(6):
        action, terminated = training._choice, k == 5
        own = tiles.claim(at[k], action)
        for slot in own:
            dense.setdefault(slot, float(tiles.weights[slot]))
        value, values = np.mean([dense[slot] for slot in own]), tiles.values(at[k + 1])
        training._learn(Transition(at[k], np.zeros(1), -float(k), at[k + 1], terminated))
        ahead = 0.0 if terminated else config.gamma * values[training._choice]
        trace *= config.gamma * config.trace
        trace[own] += 1
        for slot in dense:
            dense[slot] += config.alpha * (-k + ahead - value) * trace[slot]
    np.testing.assert_allclose(
        [tiles.weights[slot] for slot in dense], list(dense.values()), rtol=1e-4, atol=1e-5
    )
    assert trace.max() > 1


def test_explores_as_often_as_it_should():
    training = Training(Corridor(), replace(FEW_TILES, epsilon=0.3), seed=0)
    training._begin(np.random.default_rng(0))
    chosen = [training._chosen(np.array([0.0, 1.0, 1.0])) for _ in range(3000)]
    assert np.mean(np.array(chosen) == 1) == pytest.approx(0.7 + 0.3 / 3, abs=0.03)
    assert {0, 1, 2} == set(chosen)


def test_finds_the_exit():
    chance = Training(Corridor(), replace(FEW_TILES, epsilon=1.0), seed=0)
    chance._begin(np.random.default_rng(0))
    draw = lambda seen: 2 * chance.agent.actions[chance._chosen(np.zeros(3))]  # noqa: E731
    returns = play(Corridor(), draw, 20)
    training = Training(Corridor(), FEW_TILES, seed=0)
    training.run(3000)
    assert returns.mean() < -40
    assert training.test(5).mean() > -14
    assert training.best_return >= -11


def test_the_best_policy_acts_as_it_was_tested():
    env = Sym(ModelEnv(Model('leo_ode', scheme='training')))
    training = Training(env, Config(memory=2**16, test_interval=1, initial=5.0), seed=7)
    training.run(60)
    act = training.best_act()
    assert float(play(env, act, 1)[0]) == training.best_return
    seen = np.random.default_rng(0).normal(size=(5, 10))
    assert act(seen).shape == (5, 3)
    assert np.array_equal(act(seen)[2], act(seen[2]))


def test_sarsa_on_other_numbers_is_one_line():
    with pytest.raises(UserError, match='tiles over 13 numbers, here are 1 observed') as error:
        Training(Corridor(), Config(), seed=0)
    assert '\n' not in str(error.value)
