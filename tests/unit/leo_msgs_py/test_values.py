# SPDX-License-Identifier: Apache-2.0
"""Typed values and their messages, those of ROS and those of bags."""

import numpy as np
import pytest
from tests.messages import dynamic

from leo_msgs_py.cdr import decode, joint_state
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, command_message, JointStates, nanoseconds, time_message

STAMP = 1_733_000_000_123_456_789
KIND = 'sensor_msgs/msg/JointState'


def of_a_bag(value) -> object:
    if isinstance(value, Applied):
        data = joint_state(value.stamp_ns, value.names, effort=value.nan_where_free)
    else:
        effort = () if value.effort is None else value.effort
        data = joint_state(value.stamp_ns, value.names, value.position, value.velocity, effort)
    return decode(data, KIND)


def of_ros(value) -> object:
    pytest.importorskip('sensor_msgs')
    return value.to_message()


both = pytest.mark.parametrize('message', [of_a_bag, of_ros])


def test_stamps_are_exact():
    assert JointStates(STAMP, (), np.empty(0), np.empty(0)).stamp == pytest.approx(STAMP / 1e9)
    pytest.importorskip('builtin_interfaces')
    assert nanoseconds(time_message(STAMP)) == STAMP
    assert nanoseconds(time_message(-1)) == -1


@both
@pytest.mark.parametrize('effort', [None, np.array([0.5, -0.5])])
def test_joint_states_round_trip(effort, message):
    states = JointStates(STAMP, ('a', 'b'), np.array([1.0, 2.0]), np.array([0.1, 0.2]), effort)
    back = JointStates.from_message(message(states))
    assert (back.stamp_ns, back.names) == (STAMP, ('a', 'b'))
    np.testing.assert_array_equal(back.position, states.position)
    np.testing.assert_array_equal(back.velocity, states.velocity)
    np.testing.assert_array_equal(back.effort, effort)


def test_a_short_array_is_named():
    message = decode(joint_state(0, ['a', 'b'], [1.0], [0.0, 0.0]), KIND)
    with pytest.raises(UserError, match='1 position values for 2 joints'):
        JointStates.from_message(message)
    with pytest.raises(UserError, match='0 effort values for 2 joints'):
        Applied.from_message(message, 'voltage')


@both
def test_applied_round_trip(message):
    applied = Applied(STAMP, ('a', 'b'), np.array([1.5, 0.0]), 'effort', np.array([True, False]))
    sent = message(applied)
    assert len(sent.position) == len(sent.velocity) == 0
    np.testing.assert_array_equal(sent.effort, [1.5, np.nan])
    back = Applied.from_message(sent, 'effort')
    assert (back.stamp_ns, back.names, back.interface) == (STAMP, ('a', 'b'), 'effort')
    np.testing.assert_array_equal(back.values, applied.values)
    np.testing.assert_array_equal(back.enabled, [True, False])


def test_what_a_joint_state_broadcaster_publishes():
    joints = {
        'base': {'position': 0.1},
        'knee': {'position': 0.2, 'effort': 3.0},
        'hip': {'effort': 4.0, 'enabled': 0.0},
    }
    message = decode(dynamic(STAMP, joints), 'control_msgs/msg/DynamicJointState')
    applied = Applied.from_dynamic(message, 'effort')
    read = (applied.stamp_ns, applied.names, applied.interface)
    assert read == (STAMP, ('knee', 'hip'), 'effort')
    np.testing.assert_array_equal(applied.values, [3.0, 4.0])
    np.testing.assert_array_equal(applied.enabled, [True, False])
    with pytest.raises(UserError, match="interface 'voltage'"):
        Applied.from_dynamic(message, 'voltage')


def test_a_command_is_its_values_in_order():
    pytest.importorskip('std_msgs')
    assert list(command_message(np.array([1.5, -2.0])).data) == [1.5, -2.0]
