# SPDX-License-Identifier: Apache-2.0
"""The standard motion: one joint, within its limits, with free swings."""

import numpy as np
import pytest

from leo_diffmodel.datasheet.motion import motion
from leo_sim.description.robot import load_robot

MOTORS = [
    ('pendulum', 'pivot'),
    ('servo_pendulum', 'pivot'),
    ('torque_pendulum', 'pivot'),
    ('xl330_pendulum', 'pivot'),
    ('double_pendulum', 'shoulder'),
    ('so101', 'gripper'),
    ('so101', 'elbow_flex'),
]


@pytest.mark.parametrize(('name', 'joint'), MOTORS)
def test_one_joint_moves_within_its_limits(name, joint):
    robot = load_robot(name)
    run = motion(robot, joint)
    moves = np.ptp(run.inputs, axis=0) > 0
    assert [a.joint for a in np.array(robot.actuators, object)[moves]] == [joint]
    low, high = robot.bounds
    inside = 0.04 * (high - low) if robot.input == 'position' else 0.0
    assert (run.inputs[:, moves] >= (low + inside)[moves]).all()
    assert (run.inputs[:, moves] <= (high - inside)[moves]).all()


@pytest.mark.parametrize(('name', 'joint'), MOTORS)
def test_it_takes_five_minutes_with_the_fits(name, joint):
    robot = load_robot(name)
    run = motion(robot, joint)
    assert 60.0 < run.count * robot.control_period < 90.0
    free = ~run.enabled
    assert 0.05 < free.mean() < 0.3
    assert (np.diff(free.astype(int)) == 1).sum() >= 3


@pytest.mark.parametrize('joint', ['gripper', 'shoulder_lift'])
def test_goals_begin_at_rest_and_are_led_to_where_they_go_around(joint):
    robot = load_robot('so101')
    run = motion(robot, joint)
    jumps = np.abs(np.diff(run.inputs[: round(0.5 / robot.control_period)], axis=0)).max()
    assert np.abs(run.inputs[0]).max() < 0.02
    assert jumps <= 0.5 * robot.control_period + 1e-9  # 0.5 rad/s
