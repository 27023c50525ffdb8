# SPDX-License-Identifier: Apache-2.0
"""Which messages on the topic of joint states are a robot's, and of use."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

from leo_learner.robot import states as robot_states
from leo_learner.robot.states import RobotStates
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import JointStates

PIVOT = ('pivot',)


@pytest.fixture
def states() -> RobotStates:
    return RobotStates(MagicMock(), PIVOT)


def message(stamp_ns, names=PIVOT, velocity=0.5):
    values = np.full(len(names), velocity)
    return JointStates(stamp_ns, names, np.zeros(len(names)), values).to_message()


def hear(states, *messages, number=0):
    for k, each in enumerate(messages):
        states._on_message(each, {'publication_sequence_number': number + k})


def test_joints_come_in_any_order_with_others_among_them(states):
    given = JointStates(1, ('gripper', 'pivot'), np.array([9.0, 1.0]), np.array([9.0, 2.0]))
    hear(states, given.to_message())
    assert (states.latest.position.tolist(), states.latest.velocity.tolist()) == ([1.0], [2.0])


def test_a_gripper_is_no_state_of_the_robot_and_is_not_counted(states):
    hear(states, message(1), message(2, ('gripper',)))
    assert states.latest.stamp_ns == 1 and states.left_out == 0 and not states.repeated
    assert 'gripper: pivot is missing' in str(states.unusable)
    hear(states, message(3))
    assert states.latest.stamp_ns == 3 and states.unusable is None


@pytest.mark.parametrize('value', [np.nan, np.inf])
def test_states_of_no_use_are_left_out_and_counted(states, value):
    short = message(3)
    short.velocity = []
    hear(states, message(1), message(2, velocity=value), short)
    assert states.latest.stamp_ns == 1 and states.left_out == 2
    assert '2 so far' in states._node.get_logger().warning.call_args[0][0]


def test_two_robots_are_refused_by_name(states, monkeypatch):
    monkeypatch.setattr(robot_states, 'spin_until', lambda named, seconds: named())
    ends = [SimpleNamespace(node_namespace='/', node_name=name) for name in ('robot2', 'robot')]
    states._node.get_publishers_info_by_topic.return_value = ends
    hear(states, message(1), number=70)
    hear(states, message(0), number=0)  # the robot was restarted
    states.check()
    for number in (70, 1):
        hear(states, message(1), number=number)
    with pytest.raises(UserError, match=r'two robots .* \(/robot, /robot2\); give each a names'):
        states.check()
