# SPDX-License-Identifier: Apache-2.0
"""Safety: what reaches a motor is bounded, fresh, and at rest while stopped; lost packets."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from tests.robots import like

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied
from leo_sim.description.robot import load_robot
from leo_sim.drivers.base import DriverFault, robot_info
from leo_sim.drivers.safety import BadCommand, Faults, GoalSafety, Safety, safety_for

LIMITS = (7.4, 3.0)
finite = st.floats(-300.0, 300.0)
GOALS = np.array([[-1.0, -0.2], [1.0, 1.7]])
ROBOT = load_robot('xl330_pendulum')
small = st.floats(-100.0, 100.0)


@given(st.lists(st.tuples(finite, finite, st.floats(0.0, 0.05))), st.floats(0.0, 500.0))
def test_output_stays_inside_limits_and_slew(commands, slew):
    safety = Safety(LIMITS, timeout=0.0, slew=slew)
    now, before = 0.0, safety.output(0.0)
    for first, second, wait in commands:
        safety.accept((first, second), now)
        now += wait
        output = safety.output(now)
        assert np.all(np.abs(output) <= LIMITS)
        if slew:
            assert np.all(np.abs(output - before) <= slew * wait + 1e-9)
        before = output


@given(small, small)
def test_a_command_is_cut_to_its_bounds(first, second):
    for safety, bounds in (Safety(LIMITS), ((-7.4, -3.0), LIMITS)), (GoalSafety(GOALS), GOALS):
        safety.accept((first, second), 1.0)
        assert safety.output(1.0).tolist() == np.clip((first, second), *bounds).tolist()


def test_old_command_is_dropped_once_and_a_new_one_ends_it():
    safety = Safety(LIMITS, timeout=0.1)
    safety.accept((1.0, 1.0), 0.0)
    assert safety.output(0.1).tolist() == [1.0, 1.0]
    for now in (0.11, 0.2, 5.0):
        assert safety.output(now).tolist() == [0.0, 0.0]
    assert safety.timed_out and safety.timeouts == 1
    safety.accept((2.0, 2.0), 6.0)
    assert safety.output(6.0).tolist() == [2.0, 2.0] and not safety.timed_out


def test_timeout_zero_never_drops():
    safety = Safety(LIMITS, timeout=0.0)
    safety.accept((1.0, 1.0), 0.0)
    assert safety.output(1e9).tolist() == [1.0, 1.0] and safety.timeouts == 0


@given(st.lists(st.tuples(finite, finite)))
def test_e_stop_holds_zero_until_its_own_reset(commands):
    safety = Safety(LIMITS, timeout=0.0)
    safety.accept((1.0, 1.0), 0.0)
    safety.e_stop()
    for command in commands:
        safety.accept(command, 0.0)
        assert safety.output(0.0).tolist() == [0.0, 0.0]
    safety.e_stop_reset()
    assert safety.output(0.0).tolist() == [0.0, 0.0], 'commands from before the reset are gone'
    safety.accept((2.0, 2.0), 0.0)
    assert safety.output(0.0).tolist() == [2.0, 2.0]


@pytest.mark.parametrize(
    'values, said',
    [
        ((1.0,), 'it has 1 values, the robot has 2 actuators'),
        ((), 'it has 0 values, the robot has 2 actuators'),
        ((1.0, float('nan')), 'not finite'),
        ((float('inf'), 0.0), 'not finite'),
        ((1.0, 1e308), 'beyond 100 times'),
        ((-741.0, 0.0), 'beyond 100 times'),
    ],
)
def test_bad_command_is_refused_and_the_one_before_holds(values, said):
    safety = Safety(LIMITS)
    safety.accept((1.0, -1.0), 0.0)
    with pytest.raises(BadCommand, match=said):
        safety.accept(values, 0.0)
    assert safety.output(0.0).tolist() == [1.0, -1.0] and safety.rejected == 1


@pytest.mark.parametrize(
    ('limit', 'options', 'said'),
    [
        (7.4, {'timeout': -1.0}, 'give 0'),
        (7.4, {'slew': float('nan')}, 'give 0'),
        *((limit, {}, 'above 0') for limit in (0.0, -7.4, float('nan'), float('inf'))),
    ],
)
def test_impossible_settings_and_limits_are_refused(limit, options, said):
    with pytest.raises(UserError, match=said):
        Safety([3.0, limit], **options)


@given(st.lists(st.tuples(finite, finite), min_size=1), st.booleans())
def test_who_is_blind_or_stopped_drives_nothing(commands, e_stopped):
    safety = Safety(LIMITS, timeout=0.0)
    for command in commands:
        safety.accept(command, 0.0)
        if e_stopped:
            safety.e_stop()
        assert not safety.output(0.0, blind=not e_stopped).any()
        assert safety.stops(0.0) == e_stopped


def free(values) -> bool:
    return bool(np.isnan(values).all())


def test_before_the_first_command_inputs_are_0_and_motors_that_take_goals_are_free():
    assert Safety(LIMITS).output(0.0).tolist() == [0.0, 0.0]
    assert free(GoalSafety(GOALS).output(0.0))


@given(st.lists(st.tuples(small, small, st.floats(0.0, 0.05))), st.floats(0.1, 20.0))
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


def test_a_loop_that_was_late_makes_no_larger_step():
    for safety, start in (
        (GoalSafety(GOALS, 0.0, 2.0, 0.02), 0.1),
        (Safety(LIMITS, 0.0, 2.0, 0.02), 0.0),
    ):
        safety.see(np.full(2, start))
        safety.accept([0.9, 0.9], 0.0)
        safety.output(0.0)
        for now in (0.02, 1.02, 1.03):
            before, output = safety._last.copy(), safety.output(now)
            assert np.abs(output - before).max() <= 2.0 * 0.02 + 1e-12
        assert output[0] > start + 0.08, 'it stands still'


def test_a_motor_that_was_free_slews_from_the_place_where_its_torque_came_on():
    safety = GoalSafety(GOALS, slew=1.0)
    safety.see(np.array([0.3, 0.3]))
    safety.accept([-0.4, 0.9], 0.0)
    for now, taken in ((0.0, [0.35, 0.25]), (0.02, [-9.0, 9.0])):
        before = safety.output(now)
        applied = Applied(0, ('a', 'b'), np.array(taken), 'position', np.ones(2, dtype=bool))
        safety.took(applied)
    assert before.tolist() == pytest.approx([0.33, 0.27])
    assert safety.output(0.04).tolist() == pytest.approx([0.31, 0.29]), 'on, it is as it was told'


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


def test_bounds_are_the_limit_and_the_stops(tmp_path):
    assert robot_info(ROBOT).bounds.tolist() == [[-np.pi], [np.pi]]
    assert isinstance(safety_for(robot_info(ROBOT), 0.2, 0.0), GoalSafety)
    stops = '"revolute"><limit lower="-0.5" upper="9" effort="1" velocity="1"/>'
    stopped = like(ROBOT, tmp_path, ('"continuous">', stops))
    assert robot_info(stopped).bounds.tolist() == [[-0.5], [np.pi]]


def test_a_good_period_begins_the_count_anew():
    faults = Faults(patience=2)
    for why in ('lost', 'lost', '', 'lost', 'cut', ''):
        faults.note(why)
    assert (faults.total, faults.in_a_row, faults.last) == (4, 0, 'cut')


@pytest.mark.parametrize('patience', [0, 3])
def test_more_in_a_row_than_are_borne_end_it(patience):
    faults = Faults(patience)
    for _ in range(patience):
        faults.note('lost')
    with pytest.raises(DriverFault, match=f'{patience + 1} periods in a row failed.*: no answer'):
        faults.note('no answer')
