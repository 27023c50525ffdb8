# SPDX-License-Identifier: Apache-2.0
"""Messages as CDR bytes without ROS, as bags hold them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import cache
import struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from rosbags.serde import SerdeError
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from rosbags.typesys.store import Typestore

JOINT_STATE = 'sensor_msgs/msg/JointState'
FOLLOWED = 'leo_msgs/msg/Followed'
"""How control_msgs/JointTrajectoryControllerState begins, in every version: its third field
is the set point, `desired` up to Galactic and `reference` from Humble on; what follows differs."""
_CONTROL_MSGS = {
    'control_msgs/msg/InterfaceValue': 'string[] interface_names\nfloat64[] values\n',
    'control_msgs/msg/DynamicJointState': (
        'std_msgs/Header header\nstring[] joint_names\n'
        'control_msgs/InterfaceValue[] interface_values\n'
    ),
    FOLLOWED: (
        'std_msgs/Header header\nstring[] joint_names\n'
        'trajectory_msgs/JointTrajectoryPoint reference\n'
    ),
}
"""What `rosbags` lacks, from ros-controls/control_msgs (jazzy), comments dropped."""
_HEADER_STRINGS = 12  # where frame_id is: behind 4 bytes of encapsulation and the stamp
SPARE = 16  # rclpy's serialize_message leaves so many bytes at most behind a message (Fast DDS)


@cache
def typestore() -> Typestore:
    """All message types known here, codec included (shared, do not change)."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in _CONTROL_MSGS.items():
        store.register(get_types_from_msg(text, name))
    return store


def encode(message: Any) -> bytes:
    """CDR bytes of a message of `typestore`, 4-byte encapsulation header first."""
    return bytes(typestore().serialize_cdr(message, message.__msgtype__))


def decode(data: bytes, type_name: str) -> Any:
    """Message of the type 'pkg/msg/Name' from CDR bytes, read only. SerdeError: it is none."""
    for end in range(len(data), max(len(data) - SPARE, 0) - 1, -4):
        with suppress(SerdeError):
            return typestore().deserialize_cdr(data[:end], type_name)
    raise SerdeError(f'not a {type_name}')


def joints_text(data: bytes) -> bytes:
    """The bytes of frame and names of a (Dynamic)JointState; b'' where they do not read."""
    number = '<I' if data[1] else '>I'
    at = _HEADER_STRINGS
    try:
        at = _aligned(at + 4 + struct.unpack_from(number, data, at)[0])
        for _ in range(struct.unpack_from(number, data, at)[0]):
            at = _aligned(at + 4)
            at += struct.unpack_from(number, data, at)[0]
    except (struct.error, IndexError):
        return b''
    return data[_HEADER_STRINGS : at + 4]


def _aligned(at: int) -> int:
    return (at + 3) // 4 * 4


def joint_state(
    stamp_ns: int,
    names: Sequence[str],
    position: ArrayLike = (),
    velocity: ArrayLike = (),
    effort: ArrayLike = (),
) -> bytes:
    """Bytes of a sensor_msgs/JointState.

    Measured at a time [ns]; columns are (J,) or empty: position [rad] (m), velocity [rad/s] (m/s),
    effort [N m] (N; V or A where the topic says so).
    """
    columns = (np.asarray(values, np.float64) for values in (position, velocity, effort))
    return _message('sensor_msgs/msg/JointState', _header(stamp_ns), list(names), *columns)


def uint32(number: int) -> bytes:
    return _message('std_msgs/msg/UInt32', number)


def temperature(stamp_ns: int, joint: str, degrees: float) -> bytes:
    """Bytes of a sensor_msgs/Temperature [degC] of one joint's motor, measured at a time [ns]."""
    return _message('sensor_msgs/msg/Temperature', _header(stamp_ns, joint), float(degrees), 0.0)


def supply(stamp_ns: int, joint: str, volts: float) -> bytes:
    """Bytes of a sensor_msgs/BatteryState: the supply [V] of one joint's motor at a time [ns]."""
    unmeasured, empty = [np.nan] * 6, np.zeros(0, np.float32)
    return _message(
        'sensor_msgs/msg/BatteryState',
        _header(stamp_ns, joint),
        float(volts),
        *unmeasured,
        *(0, 0, 0, True, empty, empty, '', ''),
    )


def _message(type_name: str, *fields: Any) -> bytes:
    kind: Any = typestore().types[type_name]
    return encode(kind(*fields))


def _header(stamp_ns: int, frame: str = '') -> Any:
    types: Any = typestore().types
    stamp = types['builtin_interfaces/msg/Time'](*divmod(int(stamp_ns), 1_000_000_000))
    return types['std_msgs/msg/Header'](stamp, frame)
