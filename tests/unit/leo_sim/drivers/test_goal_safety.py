# SPDX-License-Identifier: Apache-2.0
"""Safety of position servos: goals are bounded, nothing moves to a goal of before."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from leo_sim.description.robot import load_robot
from leo_sim.drivers.base import DriverOptions, robot_info
from leo_sim.drivers.safety import BadCommand, GoalSafety, safety_for
from leo_sim.drivers.simulated import SimulatedDriver

GOALS = np.array([[-1.0, -0.2], [1.0, 1.7]])
ROBOT = load_robot('xl330_pendulum')
finite = st.floats(-1e3, 1e3)


def free(values) -> bool:
    return bool(np.isnan(values).all())


def test_motors_are_free_until_the_first_goal():
    assert free(GoalSafety(GOALS).output(0.0))


@given(finite, finite)
def test_goals_stay_between_their_own_bounds(first, second):
    safety = GoalSafety(GOALS)
    safety.accept((first, second), 0.0)
    assert safety.output(0.0).tolist() == np.clip((first, second), *GOALS).tolist()


@given(st.lists(st.tuples(finite, finite, st.floats(0.0, 0.05))), st.floats(0.1, 20.0))
def test_a_goal_moves_no_faster_than_the_slew_from_where_the_joint_is(commands, slew):
    safety = GoalSafety(GOALS, timeout=0.0, slew=slew)
    before, now = np.array([0.4, 0.9]), 0.0
    safety.see(before)
    for first, second, wait in commands:
        safety.accept((first, second), now)
        now += wait
        goals = safety.output(now)
        assert np.all(np.abs(goals - before) <= slew * wait + 1e-9)
        before = goals


def test_without_a_measured_angle_a_slewed_motor_stays_free():
    safety = GoalSafety(GOALS, slew=1.0)
    safety.accept((0.5, 0.5), 0.0)
    assert free(safety.output(0.0))


def test_an_old_goal_and_a_lost_state_hold_the_last_goal():
    safety = GoalSafety(GOALS, timeout=0.1)
    safety.accept((0.5, 0.5), 0.0)
    assert safety.output(0.05).tolist() == [0.5, 0.5]
    safety.accept((0.8, 0.8), 0.06)
    assert safety.output(0.07, blind=True).tolist() == [0.5, 0.5]
    assert safety.output(0.08).tolist() == [0.8, 0.8]
    assert safety.output(5.0).tolist() == [0.8, 0.8]
    assert safety.timed_out and safety.timeouts == 1
    assert not safety.must_halt(5.0) and not safety.must_halt(5.0, silent=True)


def test_e_stop_frees_and_its_reset_does_not_go_back_to_a_goal_of_before():
    safety = GoalSafety(GOALS, timeout=0.0)
    safety.accept((0.5, 0.5), 0.0)
    safety.e_stop()
    assert free(safety.output(0.1)) and safety.must_halt(0.1)
    safety.accept((0.6, 0.6), 0.2)
    assert free(safety.output(0.2)) and not safety.drives(safety.output(0.2))
    safety.e_stop_reset()
    assert free(safety.output(0.3))
    safety.accept((0.0, 0.0), 0.4)
    assert safety.drives(safety.output(0.4))


def test_torque_on_again_waits_for_a_new_goal():
    safety = GoalSafety(GOALS, timeout=0.0)
    safety.accept((0.5, 0.5), 0.0)
    safety.torque_switched()
    assert free(safety.output(0.1))


def test_a_goal_that_is_not_finite_is_refused():
    safety = GoalSafety(GOALS)
    with pytest.raises(BadCommand, match='not finite'):
        safety.accept((np.nan, 0.0), 0.0)


def test_bounds_are_the_limit_and_the_stops(tmp_path):
    assert robot_info(ROBOT).bounds.tolist() == [[-np.pi], [np.pi]]
    assert isinstance(safety_for(robot_info(ROBOT), 0.2, 0.0), GoalSafety)
    for name in ('robot.urdf', 'robot.yaml'):
        text = (ROBOT.folder / name).read_text()
        text = text.replace(
            '"continuous">',
            '"revolute">\n    <limit lower="-0.5" upper="9" effort="1" velocity="1"/>',
        )
        (tmp_path / name).write_text(text)
    assert robot_info(load_robot(tmp_path)).bounds.tolist() == [[-0.5], [np.pi]]


def test_the_simulated_servo_is_free_without_a_goal_and_says_so():
    driver = SimulatedDriver(DriverOptions(ROBOT, engine='rigid'))
    applied = driver.write(np.array([np.nan]))
    assert np.isnan(applied.nan_where_free).all()
    applied = driver.write(np.array([9.0]))
    assert applied.nan_where_free.tolist() == [np.pi]
    message = applied.to_message()
    assert list(message.position) == [np.pi] and not list(message.effort)
    assert applied.from_message(message, 'position').values.tolist() == [np.pi]
    for _ in range(300):
        driver.advance(0.01)
    assert driver.read().position[0] > 1.0
    driver.set_torque(False)
    assert not driver.write(np.array([1.0])).enabled.any()
