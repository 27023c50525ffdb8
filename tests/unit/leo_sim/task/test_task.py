# SPDX-License-Identifier: Apache-2.0
"""LEO's reward and the end of its episodes, against hand calculation."""

from dataclasses import replace

import numpy as np
import pytest

from leo_sim.description.robot import load_robot
from leo_sim.description.robot_file import TerminationFile
from leo_sim.kinematics.gait import Gait
from leo_sim.model import Model, State
from leo_sim.task.task import observation, Task

LEO, ODE = load_robot('leo'), load_robot('leo_ode')
STANDING = Model(LEO, engine='rigid').start('standing').q
STILL = np.zeros(9)
TIME = -1.5


def stepped(q, dq=STILL, **changes):
    q = np.array(q)
    for joint, value in changes.items():
        q[LEO.joint_names.index(joint)] += value
    return State(q, np.array(dq))


def test_observation_is_all_but_the_place():
    q, dq = np.arange(9.0), np.arange(9.0) + 20
    assert observation(LEO, q, dq).tolist() == [*range(2, 9), *range(22, 29)]


def test_a_metre_pays_300_and_a_step_costs():
    before, after = stepped(STANDING), stepped(STANDING, base_x=0.02)
    paid, _ = Task(LEO).reward(0, before, np.zeros(6), after)
    assert paid == pytest.approx(300 * 0.02 + TIME)


def test_work_by_hand():
    after = stepped(STANDING, [0, 0, 0, 2.0, 0, -4.0, 0, 0, 0])
    volts = np.array([5.0, -3.0, 1.0, 0.0, 0.0, 0.0])
    k, resistance = 1.344712182, 4.6
    hip = 5.0 * (5.0 - k * 1.0) / resistance
    other = 3.0 * 3.0 / resistance
    knee = 1.0 * (1.0 + k * 2.0) / resistance
    expected = -2 * (hip + other + knee) / 30 + TIME
    paid, _ = Task(LEO).reward(0, stepped(STANDING), volts, after)
    assert paid == pytest.approx(expected)


def test_a_motor_that_is_driven_pays_nothing_back():
    fast = [0, 0, 0, 6.0, 0, 0, 0, 0, 0]
    volts = np.array([2.0, 0, 0, 0, 0, 0])
    paid, _ = Task(LEO).reward(0, stepped(STANDING, fast), volts, stepped(STANDING, fast))
    assert paid == pytest.approx(TIME)


def test_a_fall_costs_75_and_ends_the_episode():
    task, fallen = Task(LEO), stepped(STANDING, torso_pitch=-1.01)
    paid, _ = task.reward(0, fallen, np.zeros(6), fallen)
    assert task.terminated(fallen)
    assert paid == pytest.approx(TIME - 75)


@pytest.mark.parametrize(
    ('changes', 'over'),
    [
        ({}, False),
        ({'torso_pitch': -0.99}, False),
        ({'torso_pitch': 1.01}, True),
        ({'left_ankle': 1.14}, True),
        ({'right_ankle': -1.14}, True),
        ({'left_knee': 0.04}, False),
        ({'left_hip': 1.4, 'right_hip': 1.4, 'left_knee': -2.5, 'right_knee': -2.5}, True),
    ],
)
def test_ends(changes, over):
    assert bool(Task(LEO).terminated(stepped(STANDING, **changes))) == over


def test_hip_height_by_hand():
    q = np.zeros(9)
    q[1] = 0.393865
    assert Gait(LEO).height_over_feet('left_hip', q) == pytest.approx(0.116 + 0.1085 + 0.04859)


def test_the_knee_rule_is_a_switch_that_is_off():
    knees = 'left_knee', 'right_knee'
    rules = [TerminationFile(quantity='angle', joint=knee, high=0.0) for knee in knees]
    assert not any(r.joint == 'left_knee' for r in LEO.termination)
    strict = Task(replace(LEO, termination=(*LEO.termination, *rules)))
    assert strict.terminated(stepped(STANDING, left_knee=0.05))
    assert not strict.terminated(stepped(STANDING))


def test_stance_is_the_foot_that_touches_then_the_one_in_front():
    gait = Gait(LEO)
    left_up = stepped(STANDING, base_z=-0.001, left_knee=-0.6, left_ankle=0.6).q
    apart = stepped(STANDING, left_hip=0.2, right_hip=-0.2).q
    deep = stepped(apart, base_z=-0.01).q
    high = stepped(STANDING, base_z=0.1).q
    assert gait.stance(left_up, 0) == 1
    assert gait.stance(deep, 1) == 0
    assert [int(gait.stance(high, before)) for before in (0, 1)] == [0, 1]
    assert gait.stance(np.stack([left_up, deep, high]), 1).tolist() == [1, 0, 1]


def test_a_walk_pays_every_footstep_whole():
    """The right leg swings, carries, and the left one is behind: 300 per metre of ankle."""
    task, stance, total = Task(ODE), 0, 0.0
    start = Model(ODE, engine='rigid').start('standing').q
    ankle = Gait(ODE)
    left = stepped(start, base_z=-0.001, right_knee=-0.6, right_ankle=0.6).q
    swung = stepped(left, right_hip=0.4, right_ankle=-0.4).q
    landed = stepped(
        start, base_z=-0.004, right_hip=0.1, right_ankle=-0.1, left_knee=-0.6, left_ankle=0.6
    ).q
    for before, after in ((left, swung), (swung, landed)):
        paid, stance = task.reward(stance, State(before, STILL), np.zeros(6), State(after, STILL))
        total += paid - TIME
    first = ankle.stride(swung, 0) - ankle.stride(left, 0)
    second = ankle.stride(landed, 1) - ankle.stride(swung, 1)
    assert stance == 1
    assert first > 0.05
    assert total == pytest.approx(300 * (first + second))
    assert ankle.stride(swung, 1) == -ankle.stride(swung, 0)


def test_many_steps_at_once_are_paid_like_one_by_one():
    rng, task = np.random.default_rng(0), Task(ODE)
    q, dq = rng.normal(0, 0.3, (2, 7, 9)), rng.normal(0, 3, (2, 7, 9))
    volts, stance = rng.uniform(-8, 8, (7, 6)), rng.integers(0, 2, 7)
    paid, after = task.reward(stance, State(q[0], dq[0]), volts, State(q[1], dq[1]))
    for row in range(7):
        one, kept = task.reward(
            stance[row], State(q[0, row], dq[0, row]), volts[row], State(q[1, row], dq[1, row])
        )
        assert one == pytest.approx(paid[row])
        assert kept == after[row]
