# SPDX-License-Identifier: Apache-2.0
"""Halves of a robot on one topic are joined by time; of two that publish the same one is read."""

import numpy as np
import pytest
from tests.messages import bag_of, state

from leo_diffmodel.bags.info import bag_info
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.bags.types import JOINT_STATE
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

ARM, PENDULUM = load_robot('double_pendulum'), load_robot('pendulum')
STEP = 10_000_000


def says(names, q, dq=None, step=STEP, count=200, late=0, frame='', clock=0):
    """States each `step` [ns] of q(t), with rates where dq is given; stamps are `clock` ahead."""
    stamps = [k * step + late for k in range(count * STEP // step)]
    many, rows = len(names), []
    for stamp in stamps:
        rates = [] if dq is None else [dq(stamp * 1e-9)] * many
        data = state(clock + stamp, names, [q(stamp * 1e-9)] * many, rates, frame=frame)
        rows.append(('/joint_states', JOINT_STATE, stamp, data))
    return rows


def line(t):
    return 0.5 * t


def test_halves_are_joined_by_time(tmp_path):
    fast = says(['shoulder'], np.sin, np.cos)
    slow = says(['elbow', 'gripper'], line, lambda _: 0.5, step=3 * STEP, late=4_000_000)
    log = bag_of(tmp_path, *fast, *slow)
    recording = read_bag(log, ARM)
    (episode,) = recording.episodes
    t = 0.01 + episode.t  # both are there from the second state of the shoulder on
    np.testing.assert_allclose(episode.q, np.column_stack([np.sin(t), 0.5 * t]), atol=1e-9)
    np.testing.assert_allclose(episode.dq[:, 1], 0.5)
    (told,) = [w for w in recording.warnings if 'publishers' in w]
    assert '(shoulder at 100 Hz; elbow at 33.3 Hz); joined by time' in told
    info = bag_info(log)
    assert set(info.joints) == {'shoulder', 'elbow', 'gripper'} and 'joined' in info.told[0]


def test_a_half_without_rates_is_differentiated(tmp_path):
    log = bag_of(tmp_path, *says(['shoulder'], np.sin, np.cos), *says(['elbow'], line, late=100))
    recording = read_bag(log, ARM)
    (episode,) = recording.episodes
    np.testing.assert_allclose(episode.dq[:, 0], np.cos(0.01 + episode.t), atol=1e-9)
    np.testing.assert_allclose(episode.dq[:, 1], 0.5, atol=1e-6)
    assert any('no velocities of elbow; differentiated' in w for w in recording.warnings)


def test_halves_on_clocks_of_their_own_are_joined_by_when_they_were_recorded(tmp_path):
    away = says(['elbow'], line, clock=10**15)
    (episode,) = read_bag(bag_of(tmp_path, *says(['shoulder'], np.sin), *away), ARM).episodes
    np.testing.assert_allclose(episode.q[:, 1], 0.5 * episode.t, atol=1e-9)


def test_nothing_is_made_up_where_a_half_was_silent(tmp_path):
    half = says(['elbow'], line, late=1_000_000)
    log = bag_of(tmp_path, *says(['shoulder'], np.sin), *half[:50], *half[100:])
    first, second = read_bag(log, ARM).episodes
    assert (len(first.t), len(second.t)) == (pytest.approx(50, abs=2), pytest.approx(99, abs=2))


def test_another_robots_joints_are_passed_over(tmp_path):
    log = bag_of(tmp_path, *says(['pivot'], np.sin), *says(['elbow'], line, late=100))
    recording = read_bag(log, PENDULUM)
    assert len(recording.episodes[0].t) == 200
    assert not any('publishers' in w for w in recording.warnings)


@pytest.mark.parametrize(('names', 'frame'), [(['pivot'], 'right'), (['pivot', 'elbow'], 'left')])
def test_a_second_publisher_is_named_and_left_out(tmp_path, names, frame):
    first = says(['pivot'], np.sin, frame='left')
    second = says(names, line, step=2 * STEP, late=1_000_000, frame=frame)
    log = bag_of(tmp_path, *first, *second)
    recording = read_bag(log, PENDULUM)
    (episode,) = recording.episodes
    np.testing.assert_allclose(episode.q[:, 0], np.sin(episode.t))
    (told,) = [w for w in recording.warnings if 'publishers' in w]
    assert "2 publishers of pivot on /joint_states: frame_id 'left' with 1 joint at 100 Hz" in told
    count = '1 joint' if len(names) == 1 else '2 joints'
    assert f"frame_id '{frame}' with {count} at 50 Hz; the first is read" in told
    if frame == 'right':
        (other,) = read_bag(log, PENDULUM, TopicMap(frame_id='right')).episodes
        np.testing.assert_allclose(other.q[:, 0] - other.q[0, 0], 0.5 * other.t, atol=1e-9)


def test_a_frame_id_that_changes_with_a_restart_is_no_second_publisher(tmp_path):
    first, again = (says(['pivot'], line, frame=frame) for frame in 'ab')
    recording = read_bag(bag_of(tmp_path, *first[:100], *again[100:]), PENDULUM)
    assert len(recording.episodes[0].t) == 200
    assert not any('publishers' in w for w in recording.warnings)


@pytest.mark.parametrize('step', [STEP, 2 * STEP])
def test_two_that_nothing_tells_apart_are_refused(tmp_path, step):
    second = says(['pivot'], lambda t: 1.0 - t, step=step, late=4_000_000)
    with pytest.raises(UserError, match=r'two publishers take turns on /joint_states .*pivot'):
        read_bag(bag_of(tmp_path, *says(['pivot'], np.sin), *second), PENDULUM)


def test_two_clocks_that_take_turns_are_refused(tmp_path):
    second = says(['pivot'], np.sin, late=100, clock=10**15)
    with pytest.raises(UserError, match=r'stamps that go back in 50% of the steps'):
        read_bag(bag_of(tmp_path, *says(['pivot'], np.sin), *second), PENDULUM)


def test_a_joint_that_chatters_is_no_second_publisher(tmp_path):
    """It goes to and fro within four states, as fast as its own speed says."""
    pace = 2 * np.pi / (4 * STEP * 1e-9)
    way, rate = lambda t: 0.05 * np.sin(pace * t), lambda t: 0.05 * pace * np.cos(pace * t)
    (episode,) = read_bag(bag_of(tmp_path, *says(['pivot'], way, rate)), PENDULUM).episodes
    assert len(episode.t) == 200
