# SPDX-License-Identifier: Apache-2.0
"""Runs of robots that take goals: 0 is a place, they begin where the robot is, and go gently."""

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from tests.simulate import PENDULUM, POSITION

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.next_run import reach
from leo_diffmodel.next_run.menu import menu
from leo_diffmodel.next_run.run_file import read_run, Run, write_run
from leo_diffmodel.next_run.settings import NEXT
from leo_diffmodel.next_run.simulate import simulate, start_of
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

SO101 = load_robot('so101')
LOW, HIGH = SO101.bounds
SHARES = st.lists(st.floats(0.0, 1.0), min_size=12, max_size=12).map(np.array)


def been(least, most) -> reach.Seen:
    return reach.Seen(np.array(least), np.array(most), np.full(6, 5.0), LOW, HIGH, 0.02)


@given(SHARES)
def test_every_run_begins_at_the_start_pose_and_stays_off_the_stops(shares):
    ends = LOW + np.sort(shares.reshape(2, 6), axis=0) * (HIGH - LOW)
    room = been(*ends).allowed(SO101)
    margin = NEXT.margin * (HIGH - LOW)
    assert np.all(room.low >= LOW + margin - 1e-9) and np.all(room.high <= HIGH - margin + 1e-9)
    assert np.all(abs(room.centre - ends.mean(axis=0)) <= 0.15 * (HIGH - LOW)), 'and not 0'
    lead = room.lead(SO101)
    for run in menu(SO101, room, 8.0):
        np.testing.assert_array_equal(run.inputs[0], reach.rest_goals(SO101))
        np.testing.assert_array_equal(run.inputs[: len(lead)], lead)
        inside = run.inputs[len(lead) :]
        assert np.all(inside >= room.low - 1e-9) and np.all(inside <= room.high + 1e-9)


@given(SHARES)
def test_a_ramp_ends_where_it_should_and_no_joint_is_faster_than_gentle(shares):
    start, end = LOW + shares.reshape(2, 6) * (HIGH - LOW)
    goals = reach.ramp(start, end, SO101)
    np.testing.assert_allclose(goals[[0, -1]], [start, end], atol=1e-9)
    speed = np.abs(np.diff(goals, axis=0)) / SO101.control_period
    assert np.all(speed <= reach.gentle_speeds(SO101) + 1e-9)


def test_a_servo_with_a_rate_of_its_own_is_no_faster_and_a_run_starts_from_rest():
    path = 'actuators.gripper.goal_rate'
    slow = dict(SO101.constants)[path.replace('goal_rate', 'limit')]
    robot = SO101.with_constants({path: type(slow)(path, 0.1, 'rad/s')})
    assert reach.gentle_speeds(robot).tolist() == [0.5] * 5 + [0.1]
    still = reach.approach(np.zeros(6), np.full(6, 0.1), robot)[-round(0.5 / 0.02) :]
    assert np.all(still == 0.1)


def test_at_rest_is_a_pose_and_not_the_angle_0():
    room = been(np.full(6, 0.4), np.full(6, 0.8)).allowed(SO101)
    runs = {run.name: run for run in menu(SO101, room, 10.0)}
    lead = len(room.lead(SO101))
    assert np.median(runs['pulses'].inputs[lead:], axis=0) == pytest.approx(room.centre)
    free = runs['kick and let go']
    assert np.all(free.inputs[~free.enabled] == room.centre)
    moved = np.any(runs['one joint at a time'].inputs[lead:] != room.centre, axis=1)
    assert moved.any()
    milder = runs['binary'].milder(np.array([1, 1, 1, 1, 1, 0.5]))
    np.testing.assert_array_equal(milder.inputs[:lead], runs['binary'].inputs[:lead])
    sizes = np.ptp(milder.inputs[lead:], axis=0) / np.ptp(runs['binary'].inputs[lead:], axis=0)
    assert sizes == pytest.approx([1, 1, 1, 1, 1, 0.5])


def test_a_servo_that_was_free_counts_as_one_that_goes_where_it_is():
    run = Run('r', '', np.full((50, 1), 0.3), np.ones(50, bool))
    (track,) = simulate([run], Model(POSITION), 0.01)
    (e,) = track.episodes
    free = Episode(e.t, e.q, e.dq, np.zeros_like(e.inputs), np.zeros(e.inputs.shape, bool))
    been_free = reach.seen([replace(track, episodes=(free,))], 0.01)
    assert been_free.least == e.q.min() and been_free.most == e.q.max() > 0.05


def test_the_file_ends_at_the_last_goal_and_a_model_begins_at_the_first(tmp_path):
    run = Run('mine', '', np.linspace(0.3, 0.5, 20)[:, None], np.ones(20, bool))
    path = write_run(tmp_path / 'run.csv', run, POSITION)
    assert path.read_text().splitlines()[-1] == '0.2,0.5,on'
    assert start_of(read_run(path).run_for(POSITION), Model(POSITION)).q == pytest.approx([0.3])
    volts = write_run(tmp_path / 'volts.csv', run, PENDULUM)
    assert volts.read_text().splitlines()[-1] == '1,0,on'


def test_from_where_the_servos_are_and_motors_have_no_way_there():
    run = Run('mine', '', np.full((10, 1), 1.0), np.zeros(10, bool))
    whole = reach.from_here(run, np.array([0.2]), POSITION)
    assert whole.inputs[0] == 0.2 and np.all(whole.inputs[-10:] == 1.0)
    assert whole.enabled[:-10].all() and not whole.enabled[-10:].any()
    assert reach.from_here(run, np.array([0.2]), PENDULUM) is run
    assert reach.Reach.of_levels(np.ones(1)).lead(PENDULUM).size == 0
