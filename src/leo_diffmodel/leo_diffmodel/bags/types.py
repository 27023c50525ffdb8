# SPDX-License-Identifier: Apache-2.0
"""Quality of service as rosbag2 keeps it: a YAML list in each channel's metadata."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
import difflib
from functools import cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys import get_typestore, Stores
from rosbags.typesys.store import Typestore
import yaml

from leo_msgs_py.cdr import typestore
from leo_msgs_py.errors import UserError

_INFINITE = {'sec': 9223372036, 'nsec': 854775807}
_NUMBERS = {
    'history': {1: 'keep_last', 2: 'keep_all'},
    'reliability': {1: 'reliable', 2: 'best_effort'},
    'durability': {1: 'transient_local', 2: 'volatile'},
}
"""Policies by rmw's number, as bags before version 9 have them."""


@dataclass(frozen=True)
class Qos:
    """Quality of service of a topic, policies by their names; the defaults are ROS's own."""

    history: str = 'keep_last'
    depth: int = 10
    reliability: str = 'reliable'
    durability: str = 'volatile'


def to_yaml(qos: Any) -> str:
    """Return the `offered_qos_profiles` text of one publisher, as rosbag2 version 9 writes it.

    Args:
        qos: a `Qos`, or rclpy's QoSProfile.
    """
    profile = {
        'history': _policy_name(qos.history),
        'depth': qos.depth,
        'reliability': _policy_name(qos.reliability),
        'durability': _policy_name(qos.durability),
        'deadline': dict(_INFINITE),
        'lifespan': dict(_INFINITE),
        'liveliness': 'automatic',
        'liveliness_lease_duration': dict(_INFINITE),
        'avoid_ros_namespace_conventions': False,
    }
    return yaml.safe_dump([profile], sort_keys=False)


def from_yaml(text: str) -> Qos:
    """Return the first profile of an `offered_qos_profiles` text, ROS's default for none.

    Names (version 9) and numbers (before) are understood; what is unknown gets the default.
    """
    found = profiles(text)
    if not found:
        return Qos()
    policies = {policy: _policy(policy, found[0].get(policy)) for policy in _NUMBERS}
    return Qos(depth=max(int(found[0].get('depth', 10)), 1), **policies)


def profiles(text: str) -> list[dict[str, Any]]:
    """Return an `offered_qos_profiles` text as the list that metadata.yaml holds."""
    return yaml.safe_load(text) or [] if text.strip() else []


def _policy_name(policy: Any) -> str:
    return str(getattr(policy, 'name', policy)).lower()


def _policy(policy: str, value: str | int | None) -> str:
    """Return a policy's name from its name ('reliable') or from rmw's number (1)."""
    names = _NUMBERS[policy]
    name = names.get(value) if isinstance(value, int) else value
    return str(name if name in names.values() else getattr(Qos, policy))


Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]

Log = TypeVar('Log')

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


def at_rows(log: Log, rows: NDArray[Any]) -> Log:
    """Return a dataclass of arrays with some of their rows, by index or mask."""
    arrays: dict[str, Any] = {f.name: getattr(log, f.name) for f in fields(log)}  # type: ignore[arg-type]
    kept = {name: a[rows] for name, a in arrays.items() if isinstance(a, np.ndarray)}
    return replace(log, **kept)  # type: ignore[type-var]


@cache
def definition(type_name: str) -> tuple[str, str]:
    """Return the `ros2msg` text (dependencies appended) and the RIHS01 hash of a type.

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
