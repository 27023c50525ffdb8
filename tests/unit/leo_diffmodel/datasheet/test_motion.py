# SPDX-License-Identifier: Apache-2.0
"""The standard motion: one joint, within its limits, with free swings."""

from dataclasses import replace

import numpy as np
import pytest
from tests.robots import CART

from leo_diffmodel.datasheet.motion import LEVEL, motion
from leo_diffmodel.next_run.dry_run import dry_run
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

MOTORS = [
    *(('pendulum', 'pivot'), ('servo_pendulum', 'pivot'), ('torque_pendulum', 'pivot')),
    *(('xl330_pendulum', 'pivot'), ('double_pendulum', 'shoulder'), ('so101', 'gripper')),
    ('so101', 'elbow_flex'),
]


@pytest.mark.parametrize(('name', 'joint'), MOTORS)
def test_one_joint_moves_within_its_limits_for_little_more_than_a_minute(name, joint):
    robot = load_robot(name)
    run = motion(Model(robot), joint)
    moves = np.ptp(run.inputs, axis=0) > 0
    assert [a.joint for a in np.array(robot.actuators, object)[moves]] == [joint]
    low, high = robot.bounds
    inside = 0.04 * (high - low) if robot.input == 'position' else 0.0
    assert (run.inputs[:, moves] >= (low + inside)[moves]).all()
    assert (run.inputs[:, moves] <= (high - inside)[moves]).all()

    assert 60.0 < run.count * robot.control_period < 90.0
    free = ~run.enabled
    if len(robot.actuators) > 1:
        assert not free.any() and dry_run(run, Model(robot)).hits == ()
    else:
        assert 0.05 < free.mean() < 0.3 and (np.diff(free.astype(int)) == 1).sum() >= 3


def test_torques_are_so_small_that_the_joint_keeps_off_its_stops():
    robot = load_robot('torque_pendulum')
    full = motion(Model(robot), 'pivot')
    stopped = replace(robot, joints=tuple(replace(j, limits=(-1.5, 1.5)) for j in robot.joints))
    model = Model(stopped, engine='rigid')
    assert dry_run(full, model).hits
    run = motion(model, 'pivot')
    assert dry_run(run, model).hits == () and run.about == full.about
    assert 0.05 < np.abs(run.inputs).max() / robot.limits[0] < LEVEL


def test_what_runs_into_a_stop_however_small_the_motion_is_said():
    model = Model(CART, engine='rigid')
    run = motion(model, 'rail')
    assert run.about.endswith(dry_run(run, model).hits[0])
    assert np.abs(run.inputs).max() == pytest.approx(LEVEL * 20.0, rel=0.01)


@pytest.mark.parametrize('joint', ['gripper', 'shoulder_lift'])
def test_goals_begin_at_rest_and_are_led_to_where_they_go_around(joint):
    robot = load_robot('so101')
    run = motion(Model(robot), joint)
    jumps = np.abs(np.diff(run.inputs[: round(0.5 / robot.control_period)], axis=0)).max()
    assert np.abs(run.inputs[0]).max() < 0.02
    assert jumps <= 0.5 * robot.control_period + 1e-9  # 0.5 rad/s
