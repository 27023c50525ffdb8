# SPDX-License-Identifier: Apache-2.0
"""Typed values and their messages."""

import numpy as np
import pytest

from leo_msgs_py import messages as m
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, Command, JointStates, nanoseconds, time_message

STAMP = 1_733_000_000_123_456_789


def test_stamps_are_exact():
    assert nanoseconds(time_message(STAMP)) == STAMP
    assert nanoseconds(time_message(-1)) == -1
    assert JointStates(STAMP, (), np.empty(0), np.empty(0)).stamp == pytest.approx(STAMP / 1e9)


@pytest.mark.parametrize('effort', [None, np.array([0.5, -0.5])])
def test_joint_states_round_trip(effort):
    states = JointStates(STAMP, ('a', 'b'), np.array([1.0, 2.0]), np.array([0.1, 0.2]), effort)
    back = JointStates.from_message(states.to_message())
    assert (back.stamp_ns, back.names) == (STAMP, ('a', 'b'))
    np.testing.assert_array_equal(back.position, states.position)
    np.testing.assert_array_equal(back.velocity, states.velocity)
    if effort is None:
        assert back.effort is None
    else:
        np.testing.assert_array_equal(back.effort, effort)


def test_a_short_array_is_named():
    message = m.JointState(name=['a', 'b'], position=[1.0], velocity=[0.0, 0.0])
    with pytest.raises(UserError, match='1 position values for 2 joints'):
        JointStates.from_message(message)


def test_applied_round_trip():
    applied = Applied(
        STAMP, ('a', 'b'), np.array([1.5, -2.0]), 'voltage', np.array([True, False]),
        {'current': np.array([0.1, 0.2])},
    )  # fmt: skip
    back = Applied.from_message(applied.to_message())
    assert (back.stamp_ns, back.names, back.interface) == (STAMP, ('a', 'b'), 'voltage')
    np.testing.assert_array_equal(back.values, applied.values)
    np.testing.assert_array_equal(back.enabled, [True, False])
    np.testing.assert_array_equal(back.extra['current'], [0.1, 0.2])


def test_what_a_joint_state_broadcaster_publishes():
    message = m.DynamicJointState(
        joint_names=['base', 'knee', 'hip'],
        interface_values=[
            m.InterfaceValue(interface_names=['position'], values=[0.1]),
            m.InterfaceValue(interface_names=['position', 'effort'], values=[0.2, 3.0]),
            m.InterfaceValue(interface_names=['effort', 'enabled'], values=[4.0, 0.0]),
        ],
    )
    applied = Applied.from_message(message)
    assert (applied.names, applied.interface) == (('knee', 'hip'), 'effort')
    np.testing.assert_array_equal(applied.values, [3.0, 4.0])
    np.testing.assert_array_equal(applied.enabled, [True, False])
    np.testing.assert_array_equal(applied.extra['position'], [0.2, np.nan])
    with pytest.raises(UserError, match="interface 'voltage'"):
        Applied.from_message(message, 'voltage')


def test_command_round_trip():
    command = Command(np.array([1.5, -2.0]))
    np.testing.assert_array_equal(Command.from_message(command.to_message()).values, [1.5, -2.0])
