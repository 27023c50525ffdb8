# SPDX-License-Identifier: Apache-2.0
"""What bags hold: the graph's topics, and of message types the `ros2msg` text and type hash."""

from __future__ import annotations

import difflib
from functools import cache
from typing import NamedTuple

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys import get_typestore, Stores
from rosbags.typesys.store import Typestore

from leo_msgs_py.cdr import typestore
from leo_msgs_py.errors import UserError

from .qos_text import Qos, to_yaml

JOINT_STATE = 'sensor_msgs/msg/JointState'
DYNAMIC_JOINT_STATE = 'control_msgs/msg/DynamicJointState'
FLOAT64_ARRAY = 'std_msgs/msg/Float64MultiArray'
TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'
CONTROLLER_STATE = 'control_msgs/msg/JointTrajectoryControllerState'
UINT32 = 'std_msgs/msg/UInt32'


class Topic(NamedTuple):
    """A topic of the graph: full name, full type name, `offered_qos_profiles` text."""

    name: str
    type: str
    qos: str


_RELIABLE = to_yaml(Qos())
_LATCHED = to_yaml(Qos(depth=1, durability='transient_local'))

STATES = Topic('/joint_states', JOINT_STATE, _RELIABLE)
EPISODE = Topic('/robot/episode', UINT32, _LATCHED)
APPLIED = {
    'voltage': Topic('/robot/applied_voltage', JOINT_STATE, _RELIABLE),
    'effort': Topic('/robot/applied_effort', JOINT_STATE, _RELIABLE),
    'position': Topic('/robot/applied_position', JOINT_STATE, _RELIABLE),
}
"""What was applied by its interface: V or N m in `effort`, rad in `position`; NaN = motor free."""
CURRENT = Topic('/robot/current', JOINT_STATE, _RELIABLE)
SUPPLY = Topic('/robot/supply', 'sensor_msgs/msg/BatteryState', _RELIABLE)
TEMPERATURE = Topic('/robot/temperature', 'sensor_msgs/msg/Temperature', _RELIABLE)


@cache
def definition(type_name: str) -> tuple[str, str]:
    """Return the `ros2msg` text (dependencies appended) and the RIHS01 hash of a type.

    Args:
        type_name: full name, as `sensor_msgs/msg/JointState`.

    Raises:
        UserError: the type is not known, naming the nearest.
    """
    known = typestore().fielddefs
    if type_name not in known:
        near = difflib.get_close_matches(type_name, known, n=1)
        hint = f'; did you mean {near[0]}?' if near else ''
        raise UserError(f'unknown message type {type_name!r}{hint}')
    text, _ = typestore().generate_msgdef(type_name, ros_version=2)
    return text, _hashing_store().hash_rihs01(type_name)


@cache
def _hashing_store() -> Typestore:
    """Return the type store with `char` as `uint8`, which is what rosidl hashes it as."""
    store = get_typestore(Stores.EMPTY)
    store.fielddefs = {
        name: (constants, [(field, _char_as_uint8(desc)) for field, desc in entries])
        for name, (constants, entries) in typestore().fielddefs.items()
    }
    return store


def _char_as_uint8(desc: FieldDesc) -> FieldDesc:
    if desc[0] == Nodetype.BASE:
        return (Nodetype.BASE, ('uint8', 0)) if desc[1][0] == 'char' else desc
    if desc[0] == Nodetype.NAME:
        return desc
    element, count = desc[1]
    return (desc[0], (_char_as_uint8(element), count))  # type: ignore[return-value]
