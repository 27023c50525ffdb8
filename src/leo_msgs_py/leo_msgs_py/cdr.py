# SPDX-License-Identifier: Apache-2.0
"""Messages as CDR bytes without ROS, as bags hold them.

Of JointStates, of which a bag is full, `rosbags` takes one of each layout; in the others like it
only stamp and numbers are read or written.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cache, lru_cache
import struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
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
_STAMP = 4  # where the stamp is: behind the encapsulation
_HEADER_STRINGS = 12  # where frame_id is: behind the stamp
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


def decoder(type_name: str) -> Callable[[bytes, str], Any]:
    if type_name != JOINT_STATE:
        return decode
    last: dict[int, _Layout] = {}  # by how long a message is

    def read(data: bytes, _: str) -> Any:
        like = last.get(len(data))
        if like is None or not like.fits(data):
            like = last[len(data)] = _Layout(data)
        return like.read(data)

    return read


class _Layout:
    """Where stamp and numbers of a JointState are; all else is the same in those like it."""

    def __init__(self, data: bytes) -> None:
        self._data, self._first = data, decode(data, JOINT_STATE)
        order = '<' if data[1] else '>'
        self._stamp, self._float = struct.Struct(f'{order}iI'), np.dtype(f'{order}f8')
        self._numbers = list(_numbers(data, order))
        ends = [_HEADER_STRINGS, *(at + 8 * count for at, count in self._numbers)]
        between = zip(ends, (at for at, _ in self._numbers), strict=False)
        self._same = [(slice(a, b), data[a:b]) for a, b in [(0, _STAMP), *between]]

    def fits(self, data: bytes) -> bool:
        """Whether a message as long as the first is like it."""
        return [data[at] for at, _ in self._same] == [same for _, same in self._same]

    def read(self, data: bytes) -> Any:
        header = self._first.header
        stamp = type(header.stamp)(*self._stamp.unpack_from(data, _STAMP))
        numbers = [np.frombuffer(data, self._float, n, at) for at, n in self._numbers]
        columns = [column.astype(np.float64, copy=False) for column in numbers]
        return type(self._first)(type(header)(stamp, header.frame_id), self._first.name, *columns)

    def written(self, stamp_ns: int, columns: Sequence[NDArray[np.float64]]) -> bytes:
        data = bytearray(self._data)
        self._stamp.pack_into(data, _STAMP, *divmod(int(stamp_ns), 1_000_000_000))
        for (at, count), column in zip(self._numbers, columns, strict=True):
            data[at : at + 8 * count] = column.tobytes()
        return bytes(data)


def _numbers(data: bytes, order: str) -> Iterator[tuple[int, int]]:
    """Where position, velocity and effort begin in a JointState, and how many each are."""
    at = _HEADER_STRINGS + len(joints_text(data))
    for _ in range(3):
        at = _aligned(at)
        (count,) = struct.unpack_from(f'{order}I', data, at)
        at += 4 + (-at % 8 if count else 0)  # of what is behind the 4 bytes, a number begins at 8s
        yield at, count
        at += 8 * count


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
    columns = [np.asarray(values, np.float64) for values in (position, velocity, effort)]
    return _like(tuple(names), *map(len, columns)).written(stamp_ns, columns)


@lru_cache(maxsize=64)
def _like(names: tuple[str, ...], *counts: int) -> _Layout:
    return _Layout(_message(JOINT_STATE, _header(0), list(names), *map(np.zeros, counts)))


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
