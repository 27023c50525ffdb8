# SPDX-License-Identifier: Apache-2.0
"""When inputs act, where a controller feeds measurement noise back into them."""

import numpy as np
import pytest
from tests.simulate import DT, of_robot

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.check.check import Bag, look_at
from leo_diffmodel.check.hold import shifted
from leo_diffmodel.compare.noise import estimate, short_windows
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

MODEL = Model(load_robot('torque_pendulum'))
SIGMA = np.array([1e-3, 0.03])  # of angle [rad] and speed [rad/s]


def fed_back(seed: int, late: int = 1) -> Recording:
    """24 s after a moving goal, each torque `late` periods after the state it is computed from."""
    rng, state = np.random.default_rng(seed), MODEL.start()
    t = np.arange(2400) * DT
    goal = 0.25 * np.sin(np.outer(t, rng.uniform(2, 9, 4)) + rng.uniform(0, 6, 4)).sum(axis=1)
    torque, rows = [np.zeros(1)] * late, []
    for wanted in goal:
        q, dq = np.concatenate([state.q, state.dq]) + rng.normal(0, SIGMA)
        torque.append(np.clip([15 * (wanted - q) - 2 * dq], -6, 6))
        rows.append((q, dq, torque[len(rows)][0]))
        state = MODEL.step(state, torque[len(rows) - 1], DT)
    q, dq, u = (column[:, None] for column in np.array(rows).T)
    on = np.ones(u.shape, bool)
    return of_robot(MODEL.robot, Episode(t=t, q=q, dq=dq, inputs=u, enabled=on))


def said(recording: Recording) -> str:
    sigma = estimate(MODEL, short_windows([recording]))[0]
    found, _ = look_at(Bag(recording, shifted(recording, -DT)), MODEL, sigma)
    return next(f.severity for f in found if f.code == 'hold')


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('late', [0, 1])
def test_fed_back_noise_is_no_reason_to_move_inputs(seed, late):
    assert said(fed_back(seed, late)) == 'ok'


def test_when_inputs_act_is_asked_once_time_is_right():
    """A servo's loop of 24 Hz stamped as 30: goals seem to act a row early, and do not."""
    robot = load_robot('xl330_pendulum')
    rng, period = np.random.default_rng(1), 1 / 24
    goals = np.repeat(rng.uniform(-0.9, 0.9, 200), 8)[:1440, None]
    model = Model(robot)
    state, rows = model.start(), []
    for goal in goals:
        rows.append(state.q)
        state = model.step(state, goal, period)
    t, q = np.arange(len(goals)) / 30, np.array(rows) + rng.normal(0, 4e-4, goals.shape)
    on = np.ones(goals.shape, bool)
    episode = Episode(t=t, q=q, dq=np.gradient(q, t, axis=0), inputs=goals, enabled=on)
    log = of_robot(robot, episode, period=1 / 30, rates='absent')
    sigma = estimate(model, short_windows([log]))[0]
    found, _ = look_at(Bag(log, shifted(log, -1 / 30)), model, sigma)
    assert [f.code for f in found if f.severity == 'error'] == ['time_stretch']
