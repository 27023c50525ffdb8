# SPDX-License-Identifier: Apache-2.0
"""Missing torque where dry friction holds the joint still and no torque shows."""

from pathlib import Path

import numpy as np
import pytest

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.compare.torque import missing_torque
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

PERIOD, STILL, MOVING = 0.01, 200, 200
SIGMA = np.array([[1e-3, 0.03]])


@pytest.fixture(scope='module')
def model() -> Model:
    robot = load_robot('pendulum')
    return Model(robot, effects=(place(robot, 'coulomb_friction', 'pivot', c=0.002),))


def recording(model: Model, volts: np.ndarray) -> Recording:
    state, seen = model.start(), []
    for u in volts[:, None]:
        seen.append(np.concatenate(model.sense(state)))
        state = model.step(state, u, PERIOD)
    q, dq = np.array(seen).T[:, :, None]
    u = volts[:, None]
    episode = Episode(np.arange(len(volts)) * PERIOD, q, dq, u, np.ones_like(u, bool))
    return Recording(
        Path('bags/stuck'), '0' * 64, ('pivot',), ('pivot',), 'voltage', 0.01, (episode,), {}
    )


def test_windows_that_are_held_still_are_left_out(model):
    swing = 3.0 * np.sign(np.sin(np.arange(MOVING) * 0.1))
    found = missing_torque([recording(model, np.r_[np.zeros(STILL), swing])], model, SIGMA)
    assert found.time.min() > (STILL - 10) * PERIOD
    assert len(found.time) == len(found.torque) == found.windows.count > 10
    assert np.abs(found.torque).max() < 1e-4


def test_a_run_that_never_moves_tells_nothing(model):
    found = missing_torque([recording(model, np.zeros(STILL))], model, SIGMA)
    assert np.abs(found.torque).max() == pytest.approx(0.0, abs=1e-6)
    assert found.spread.min() > 0.01
