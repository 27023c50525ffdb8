# SPDX-License-Identifier: Apache-2.0
"""Trajectories, and what controllers say they follow, are goals; they follow the angle's turn."""

import numpy as np
import pytest
from tests.messages import bag_of, controller_state, state, trajectory

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import JointMap, TopicMap
from leo_diffmodel.bags.types import CONTROLLER_STATE, JOINT_STATE, TRAJECTORY
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

SERVO, ARM = load_robot('xl330_pendulum'), load_robot('so101')
STEP = 10_000_000
EPOCH = 1_700_000_000 * 10**9
TOPIC, FOLLOWED = '/arm_controller/joint_trajectory', '/arm_controller/controller_state'
VERSIONS = {
    'galactic': ('desired', 'actual', 'error'),
    'humble': ('reference', 'feedback', 'error', 'output', 'desired', 'actual'),
    'jazzy': ('reference', 'feedback', 'error', 'output'),
}


def states(count=100, q=0.2, names=('pivot',)):
    stamps = [EPOCH + k * STEP for k in range(count)]
    data = {stamp: state(stamp, names, [q] * len(names)) for stamp in stamps}
    return [('/joint_states', JOINT_STATE, at + 3_000_000, each) for at, each in data.items()]


def asks(k, points, stamp=0, names=('pivot',), topic=TOPIC):
    """A trajectory recorded at state k; times of its points in states."""
    goals = {after * STEP: goal for after, goal in points.items()}
    return topic, TRAJECTORY, EPOCH + k * STEP + 3_000_000, trajectory(stamp, names, goals)


def goals(recording):
    return recording.episodes[0].inputs[:, 0]


def test_a_point_is_the_goal_at_its_time_and_straight_before_it(tmp_path):
    log = bag_of(tmp_path, *states(), asks(10, {4: [1.0]}), asks(30, {0: [0.5]}))
    recording = read_bag(log, SERVO)
    assert recording.input == 'position' and recording.episodes[0].enabled.all()
    found = goals(recording)
    np.testing.assert_allclose(found[:5], [0.2, 0.4, 0.6, 0.8, 1.0])  # from where the joint was
    np.testing.assert_allclose(found[4:20], 1.0)
    np.testing.assert_allclose(found[20:], 0.5)


def test_many_points_count_from_the_stamp_and_a_new_trajectory_replaces_the_rest(tmp_path):
    way = {10: [1.2], 20: [0.2], 30: [9.0]}
    log = bag_of(tmp_path, *states(), asks(5, way, EPOCH + 10 * STEP), asks(35, {5: [0.2]}))
    found = goals(read_bag(log, SERVO))  # from state 10 on
    np.testing.assert_allclose(found[:11], np.linspace(0.2, 1.2, 11))
    np.testing.assert_allclose(found[10:21], np.linspace(1.2, 0.2, 11))
    assert found[24] == pytest.approx(0.2 + 0.4 * 8.8)
    np.testing.assert_allclose(found[25:31], np.linspace(0.2 + 0.5 * 8.8, 0.2, 6))
    np.testing.assert_allclose(found[30:], 0.2)


@pytest.mark.parametrize('version', VERSIONS)
def test_what_a_controller_follows_goes_before_what_it_was_asked(tmp_path, version):
    follows = []
    for k in range(0, 100, 2):
        data = controller_state(EPOCH + k * STEP, ['pivot'], [0.01 * k], VERSIONS[version])
        follows.append((FOLLOWED, CONTROLLER_STATE, EPOCH + k * STEP, data))
    log = bag_of(tmp_path, *states(), *follows, asks(0, {0: [5.0]}))
    recording = read_bag(log, SERVO)
    np.testing.assert_allclose(goals(recording)[:99], 0.01 * np.arange(99), atol=1e-12)
    assert not any('look' in text for text in recording.warnings)
    assert set(goals(read_bag(log, SERVO, TopicMap(input='trajectory')))) == {5.0}


def test_joints_have_their_goals_from_the_topics_that_name_them(tmp_path):
    arm, gripper = ARM.joint_names[:-1], ARM.joint_names[-1:]
    rows = states(names=ARM.joint_names)
    rows += [asks(0, {0: [0.3] * 5}, names=arm), asks(0, {0: [0.7]}, 0, gripper, '/gripper/goal')]
    (episode,) = read_bag(bag_of(tmp_path, *rows), ARM).episodes
    assert episode.inputs[-1].tolist() == [0.3] * 5 + [0.7]
    with pytest.raises(UserError, match=f'none for {gripper[0]}'):
        read_bag(bag_of(tmp_path, *rows[:-1]), ARM)


def test_goals_take_the_sign_and_the_zero_of_the_angle(tmp_path):
    mapped = TopicMap(joints={'pivot': JointMap(name='hinge', sign=-1, offset=0.5)})
    log = bag_of(tmp_path, *states(names=('hinge',)), asks(0, {4: [1.0]}, names=('hinge',)))
    np.testing.assert_allclose(goals(read_bag(log, SERVO, mapped))[[0, 4]], [0.5 - 0.2, 0.5 - 1.0])


def test_two_trajectories_of_a_joint_are_asked_about(tmp_path):
    log = bag_of(tmp_path, *states(), asks(0, {0: [1.0]}), asks(0, {0: [2.0]}, topic='/planned'))
    with pytest.raises(UserError, match=r'pivot on /arm_controller/joint_trajectory and /planned'):
        read_bag(log, SERVO)
    assert set(goals(read_bag(log, SERVO, TopicMap(topics={'trajectory': '/planned'})))) == {2.0}


def test_a_restarted_robot_begins_without_a_goal(tmp_path):
    again = [(topic, kind, log + 200 * STEP, data) for topic, kind, log, data in states()]
    topic, kind, log, data = asks(20, {0: [0.5]})
    rows = [*states(), asks(10, {0: [1.0]}), *again, (topic, kind, log + 200 * STEP, data)]
    first, second = read_bag(bag_of(tmp_path, *rows), SERVO).episodes
    assert set(first.inputs[:, 0]) == {1.0} and set(second.inputs[:, 0]) == {0.5}
    assert (len(first.t), len(second.t)) == (90, 80)


def test_hostile_trajectories_are_no_goals(tmp_path):
    wrong = [asks(5, {0: [np.nan]}), asks(5, {0: [1.0, 2.0]}), asks(5, {})]
    topic, kind, log, data = asks(5, {0: [7.0]})
    cut = [(topic, kind, log, data[:40]), (FOLLOWED, CONTROLLER_STATE, log, data[:9])]
    recording = read_bag(bag_of(tmp_path, *states(), asks(0, {0: [1.0]}), *wrong, *cut), SERVO)
    assert set(goals(recording)) == {1.0}
    assert any('2 messages could not be decoded' in text for text in recording.warnings)


def test_joints_of_one_name_have_the_same_goals(tmp_path):
    same = TopicMap(joints={name: JointMap(name='pivot') for name in ARM.joint_names})
    recording = read_bag(bag_of(tmp_path, *states(), asks(0, {0: [1.0]})), ARM, same)
    assert recording.episodes[0].inputs.shape[1] == 6 and (recording.episodes[0].inputs == 1).all()


T = 0.01 * np.arange(800)


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def recorded(folder, q, dq, goal, enabled=None):
    on = np.ones_like(T) if enabled is None else enabled
    inputs = {'pivot': {'position': goal, 'enabled': on}}
    run = Run(T, ['pivot'], q[:, None], dq[:, None], inputs=inputs)
    return read_bag(write_runs(folder / 'bag', [run], {}), SERVO)


WAYS = {
    'on and on': (2 * T, np.full_like(T, 2.0)),
    'back': (-2 * T, np.full_like(T, -2.0)),
    'around pi': (np.pi - 0.1 + 0.3 * np.sin(3 * T), 0.9 * np.cos(3 * T)),
}


@pytest.mark.parametrize('way', WAYS)
@pytest.mark.parametrize('angle', [wrapped, np.asarray])
@pytest.mark.parametrize('asked', [wrapped, np.asarray])
def test_goals_follow_the_turn_of_the_angle(tmp_path, way, angle, asked):
    q, dq = WAYS[way]
    recording = recorded(tmp_path, angle(q), dq, asked(q + 0.05))
    (episode,) = recording.episodes
    np.testing.assert_allclose(episode.inputs - episode.q, 0.05, atol=0.02)
    told = [w for w in recording.warnings if 'wrapped apart' in w]
    assert len(told) == bool(np.abs(asked(q + 0.05) - q - 0.05).max() > 6)


def test_an_angle_that_begins_in_another_turn_than_its_goals(tmp_path):
    q = 4 * np.pi + np.sin(T)
    (episode,) = recorded(tmp_path, wrapped(q), np.cos(T), q + 0.05).episodes
    np.testing.assert_allclose(episode.inputs - episode.q, 0.05, atol=0.02)


@pytest.mark.parametrize(
    'goal',
    [np.where(T < 2, 0, 4.0), np.where((T > 2) & (T < 2.3), 4.0, 0), np.where(T < 2, -3.1, 3.1)],
)
def test_a_goal_that_steps_far_is_meant(tmp_path, goal):
    rate = np.zeros_like(T)
    q = np.zeros_like(T)
    q[0] = goal[0]
    for k in range(1, len(T)):  # a servo that turns by 2 rad/s at most
        rate[k] = np.clip(5 * (goal[k - 1] - q[k - 1]), -2, 2)
        q[k] = q[k - 1] + 0.01 * rate[k]
    recording = recorded(tmp_path, q, rate, goal)
    assert np.array_equal(recording.episodes[0].inputs[:, 0], goal)
    assert not any('wrapped apart' in w for w in recording.warnings)


def test_a_free_motor_has_no_goal(tmp_path):
    q, dq = WAYS['on and on']
    on = np.where((T > 3) & (T < 4), 0.0, 1.0)
    (episode,) = recorded(tmp_path, wrapped(q), dq, wrapped(q + 0.05), on).episodes
    counts = episode.enabled[:, 0]
    np.testing.assert_allclose((episode.inputs - episode.q)[counts], 0.05, atol=0.02)
    assert not episode.inputs[~counts].any()
