# SPDX-License-Identifier: Apache-2.0
"""Trajectories, and what their controllers say they follow, are goals of servos."""

import numpy as np
import pytest
from tests.messages import bag_of, controller_state, state, trajectory

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import JointMap, TopicMap
from leo_diffmodel.bags.types import CONTROLLER_STATE, JOINT_STATE, TRAJECTORY
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

SERVO, PENDULUM, ARM = (load_robot(n) for n in ('xl330_pendulum', 'pendulum', 'so101'))
STEP = 10_000_000
EPOCH = 1_700_000_000 * 10**9
TOPIC, FOLLOWED = '/arm_controller/joint_trajectory', '/arm_controller/controller_state'
VERSIONS = {
    'galactic': ('desired', 'actual', 'error'),
    'humble': ('reference', 'feedback', 'error', 'output', 'desired', 'actual'),
    'jazzy': ('reference', 'feedback', 'error', 'output'),
}


def states(count=100, q=0.2, names=('pivot',)):
    """Joints that stand, recorded 3 ms late."""
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
    asked = read_bag(log, SERVO, TopicMap(input='trajectory'))
    assert set(goals(asked)) == {5.0}


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
    found = goals(read_bag(log, SERVO, mapped))
    np.testing.assert_allclose(found[[0, 4]], [0.5 - 0.2, 0.5 - 1.0])


def test_two_trajectories_of_a_joint_are_asked_about(tmp_path):
    log = bag_of(tmp_path, *states(), asks(0, {0: [1.0]}), asks(0, {0: [2.0]}, topic='/planned'))
    with pytest.raises(UserError, match=r'pivot on /arm_controller/joint_trajectory and /planned'):
        read_bag(log, SERVO)
    chosen = TopicMap(topics={'trajectory': '/planned'})
    assert set(goals(read_bag(log, SERVO, chosen))) == {2.0}


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
