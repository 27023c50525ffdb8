# SPDX-License-Identifier: Apache-2.0
"""The missing torque is the one that was there."""

import numpy as np
import pytest
from tests.simulate import DT, PENDULUM, record, TORQUE

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.torque import _covariance, missing_torque
from leo_sim.effects import place
from leo_sim.model import Model

STILL, MOVING = 200, 200
SIGMA = np.array([[1e-3, 0.03]])


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE], ids=lambda r: r.name)
def test_the_missing_torque_is_the_one_that_was_applied(robot):
    stall = {'pendulum': 0.0169, 'torque_pendulum': 6.0}[robot.name]
    torque = 0.02 * stall
    data = record(robot, seconds=20, push=np.full((2000, 1), torque))
    missing = missing_torque([data], Model(robot), np.array([[1e-3, 0.05]]))
    error = missing.torque[:, 0] - torque
    assert abs(error.mean()) < 4 * missing.spread.mean() / np.sqrt(len(error))
    assert np.sqrt((error**2).mean()) == pytest.approx(missing.spread.mean(), rel=0.15)


def test_a_torque_that_changes_is_followed():
    t = 0.01 * np.arange(2000)
    push = 0.5 * np.sin(2 * np.pi * 0.5 * t)[:, None]
    bag = record(TORQUE, seconds=20, push=push)
    missing = missing_torque([bag], Model(TORQUE), np.array([[1e-3, 0.05]]))
    truth = 0.5 * np.sin(2 * np.pi * 0.5 * missing.time)
    assert np.corrcoef(missing.torque[:, 0], truth)[0, 1] > 0.8
    assert missing.torque[:, 0] @ truth / (truth @ truth) == pytest.approx(1.0, abs=0.1)


def test_columns_too_far_apart_for_floating_point_still_have_a_covariance():
    """A contact that ends in a window can make one column 10^12 times as long as another."""
    first, second = np.random.default_rng(1).standard_normal((2, 30))
    columns = np.stack([1e12 * first, 1e12 * first, second], axis=-1)[None]
    variance = np.diagonal(_covariance(columns)[0])
    assert np.all(variance > 0)
    assert variance[2] == pytest.approx(1 / (second @ second), rel=0.2)


@pytest.fixture(scope='module')
def rubbing() -> Model:
    return Model(PENDULUM, effects=(place(PENDULUM, 'coulomb_friction', 'pivot', c=0.002),))


def pushed_about(model: Model, volts: np.ndarray) -> Recording:
    return record(PENDULUM, *model.effects, inputs=volts[:, None], noise=(0.0, 0.0))


def test_windows_that_are_held_still_are_left_out(rubbing):
    swing = 3.0 * np.sign(np.sin(np.arange(MOVING) * 0.1))
    found = missing_torque([pushed_about(rubbing, np.r_[np.zeros(STILL), swing])], rubbing, SIGMA)
    assert found.time.min() > (STILL - 10) * DT
    assert len(found.time) == len(found.torque) == found.windows.count > 10
    assert np.abs(found.torque).max() < 1e-4


def test_a_run_that_never_moves_says_nothing(rubbing):
    found = missing_torque([pushed_about(rubbing, np.zeros(STILL))], rubbing, SIGMA)
    assert np.abs(found.torque).max() == pytest.approx(0.0, abs=1e-6)
    assert found.spread.min() > 0.01
