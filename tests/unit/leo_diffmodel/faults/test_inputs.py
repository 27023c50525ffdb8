# SPDX-License-Identifier: Apache-2.0
"""Inputs in each other's columns and inputs that were lost, beside friction of all joints."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import record, steps

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.find import faults_of
from leo_diffmodel.faults.mending import mapped, mended
from leo_diffmodel.outside.outside import moved_from_outside
from leo_lab.blind.spoil import spoil
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

ROBOT = load_robot('double_pendulum')
FRICTION = (
    place(ROBOT, 'coulomb_friction', 'shoulder', c=0.15),
    place(ROBOT, 'viscous_friction', 'shoulder', b=0.05),
    place(ROBOT, 'coulomb_friction', 'elbow', c=0.06),
    place(ROBOT, 'viscous_friction', 'elbow', b=0.02),
)


def inputs(seconds: float, seed: int = 5) -> np.ndarray:
    return 0.3 * np.hstack([steps(ROBOT, seconds, s) for s in (seed, seed + 1)])


@pytest.fixture(scope='module')
def log() -> Recording:
    return record(ROBOT, *FRICTION, seconds=20, inputs=inputs(20))


def with_inputs(log: Recording, u: np.ndarray) -> Recording:
    return replace(log, episodes=(replace(log.episodes[0], inputs=u),))


def errors(log: Recording) -> list:
    return [f for f in faults_of(log, Model(ROBOT)) if f.error]


def test_friction_at_all_joints_is_no_fault(log):
    assert errors(log) == [] and moved_from_outside(log, Model(ROBOT)) == []


def test_exchanged_inputs_are_told_and_put_right(log):
    (e,) = log.episodes
    wrong = with_inputs(log, spoil('input_exchanged', e, 0, 0, 1.0).inputs)
    (told,) = errors(wrong)
    assert told.code == 'input_exchanged' and {*told.names} == {'shoulder', 'elbow'}
    assert told.line.startswith('input_of: {')
    (again,) = mapped(wrong, [told]).episodes
    assert again.inputs == pytest.approx(e.inputs)
    assert moved_from_outside(mapped(wrong, [told]), Model(ROBOT)) == []


def test_no_hand_is_blamed_for_exchanged_inputs(log):
    wrong = with_inputs(log, log.episodes[0].inputs[:, ::-1])
    assert 'hand' not in {f.code for f in moved_from_outside(wrong, Model(ROBOT))}


def test_an_input_that_was_lost_is_told_and_left_out(log):
    u = log.episodes[0].inputs.copy()
    u[600:, 0] = 0.0
    (told,) = errors(with_inputs(log, u))
    assert (told.code, told.joint) == ('input_dead', 'shoulder')
    assert told.value == pytest.approx(0.7, abs=0.01)
    left = mended(with_inputs(log, u), [told])
    assert max(e.t[-1] for e in left.episodes) < 6.1


def test_motors_that_rest_are_no_lost_inputs():
    u = inputs(20)
    u[500:1100] = 0.0
    u[1500:, 1] = 0.0
    assert errors(record(ROBOT, *FRICTION, seconds=20, inputs=u)) == []
