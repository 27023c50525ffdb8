# SPDX-License-Identifier: Apache-2.0
"""Torque laws that remember, or that know the time: stepping and windows agree."""

import numpy as np
import pytest
from tests.models import stepped
from tests.simulate import DT, PENDULUM, steps, TORQUE

from leo_lab.blind import kinds
from leo_sim.effects import get_effect, place
from leo_sim.model import Model
from leo_sim.model.batch import rollout

LAWS = {
    'periodic_torque': {'a': 0.3, 'f': 1.3, 'phase': 0.5},
    'hysteresis': {'c': 0.25, 'reach': 0.5},
    'winding_drift': {'rise': 0.4, 'tau': 1.0},
}
WEAKER = {'periodic_torque': {'a': 3e-4}, 'hysteresis': {'c': 2e-4}, 'winding_drift': {}}
ROBOTS = pytest.mark.parametrize('robot', [PENDULUM, TORQUE], ids=lambda r: r.name)
KINDS = pytest.mark.parametrize('kind', sorted(LAWS))


def model(robot, kind, **physics):
    effect = get_effect(kinds.__file__.replace('__init__', kind))
    values = LAWS[kind] | (WEAKER[kind] if robot is PENDULUM else {})
    return Model(robot, [place(robot, effect, 'pivot', **values)], **physics)


@KINDS
@ROBOTS
def test_a_window_from_the_start_is_the_run_itself(robot, kind):
    made, inputs = model(robot, kind, engine='rigid'), steps(robot, 1.5, 3)
    q, dq = stepped(made, inputs)
    along, _ = rollout(made, q[None, 0], dq[None, 0], inputs[None], DT)
    np.testing.assert_allclose(along[0], q, atol=1e-9)


@KINDS
@ROBOTS
def test_a_later_window_knows_the_time_and_the_path(robot, kind):
    made, inputs = model(robot, kind, engine='rigid'), steps(robot, 3.0, 3)
    q, dq = stepped(made, inputs)
    first = 200
    past = (q[None, :first], dq[None, :first], inputs[None, :first], None, np.full((1, first), DT))
    given, start = (q[None, first], dq[None, first], inputs[None, first:]), np.array([first * DT])
    along, _ = rollout(made, *given, DT, history=past, start=start)
    fresh, _ = rollout(made, q[None, first], dq[None, first], inputs[None, first:], DT)
    missed = np.abs(fresh[0] - q[first:]).max()
    assert missed > 1e-3
    assert np.abs(along[0] - q[first:]).max() < 0.05 * missed


@KINDS
def test_another_integrator_moves_the_memory_alike(kind):
    inputs = steps(TORQUE, 1.0, 3)
    one, _ = stepped(model(TORQUE, kind, engine='rigid'), inputs)
    other, _ = stepped(model(TORQUE, kind, engine='rk4', integration_step=0.0005), inputs)
    without, _ = stepped(Model(TORQUE, engine='rigid'), inputs)
    assert np.abs(one - other).max() < 0.05 * np.abs(one - without).max()
