# SPDX-License-Identifier: Apache-2.0
"""Topics of the graph, types of messages, quality of service as rosbag2 keeps it (YAML)."""

from dataclasses import fields, replace
import difflib
from functools import cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.store import TIDMAP
import yaml

from leo_msgs_py.cdr import JOINT_STATE as JOINT_STATE
from leo_msgs_py.cdr import typestore
from leo_msgs_py.errors import UserError

TIDMAP['char'] = TIDMAP['uint8']  # rosidl hashes char as uint8, rosbags 0.11 does not
_INFINITE = {'sec': 9223372036, 'nsec': 854775807}


def to_yaml(
    history: str = 'keep_last',
    depth: int = 10,
    reliability: str = 'reliable',
    durability: str = 'volatile',
) -> str:
    """Return the `offered_qos_profiles` text of one publisher, as rosbag2 version 9 writes it."""
    profile = {
        'history': history,
        'depth': depth,
        'reliability': reliability,
        'durability': durability,
        'deadline': dict(_INFINITE),
        'lifespan': dict(_INFINITE),
        'liveliness': 'automatic',
        'liveliness_lease_duration': dict(_INFINITE),
        'avoid_ros_namespace_conventions': False,
    }
    return yaml.safe_dump([profile], sort_keys=False)


def profiles(text: str) -> list[dict[str, Any]]:
    """Return an `offered_qos_profiles` text as the list that metadata.yaml holds; [] of none."""
    try:
        found = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        return []
    return [each for each in found if isinstance(each, dict)] if isinstance(found, list) else []


Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]

Log = TypeVar('Log')

DYNAMIC_JOINT_STATE = 'control_msgs/msg/DynamicJointState'
FLOAT64_ARRAY = 'std_msgs/msg/Float64MultiArray'
TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'
CONTROLLER_STATE = 'control_msgs/msg/JointTrajectoryControllerState'
UINT32 = 'std_msgs/msg/UInt32'
TYPES = {
    'joint_states': JOINT_STATE,
    'applied': JOINT_STATE,
    'dynamic_joint_states': DYNAMIC_JOINT_STATE,
    'commands': FLOAT64_ARRAY,
    'controller_state': CONTROLLER_STATE,
    'trajectory': TRAJECTORY,
    'episode': UINT32,
}
"""Type of each role that a topic may play in a bag (`topic_map.Role`)."""


class Topic(NamedTuple):
    """A topic of the graph: full name, full type name, `offered_qos_profiles` text."""

    name: str
    type: str
    qos: str = ''

    @property
    def latched(self) -> bool:
        return LATCHED in self.qos

    @property
    def whole(self) -> bool:
        """Whether a reader is owed every message, and not the newest alone."""
        return not self.latched and 'best_effort' not in self.qos


LATCHED = 'transient_local'  # the durability of what late readers get
_RELIABLE = to_yaml()
_LATCHED = to_yaml(depth=1, durability=LATCHED)

STATES = Topic('/joint_states', JOINT_STATE, _RELIABLE)
EPISODE = Topic('/robot/episode', UINT32, _LATCHED)
APPLIED = {
    interface: Topic(f'/robot/applied_{interface}', JOINT_STATE, _RELIABLE)
    for interface in ('voltage', 'effort', 'position')
}
"""What was applied by its interface: V or N m in `effort`, rad in `position`; NaN = motor free."""
CURRENT = Topic('/robot/current', JOINT_STATE, _RELIABLE)
SUPPLY = Topic('/robot/supply', 'sensor_msgs/msg/BatteryState', _RELIABLE)
TEMPERATURE = Topic('/robot/temperature', 'sensor_msgs/msg/Temperature', _RELIABLE)


def at_rows(log: Log, rows: NDArray[Any]) -> Log:
    arrays: dict[str, Any] = {f.name: getattr(log, f.name) for f in fields(log)}  # type: ignore[arg-type]
    kept = {name: a[rows] for name, a in arrays.items() if isinstance(a, np.ndarray)}
    return replace(log, **kept)  # type: ignore[type-var]


@cache
def definition(type_name: str) -> tuple[str, str]:
    """The `ros2msg` text (dependencies appended) and RIHS01 hash; refuse an unknown type."""
    known = typestore().fielddefs
    if type_name not in known:
        near = difflib.get_close_matches(type_name, known, n=1)
        hint = f'; did you mean {near[0]}?' if near else ''
        raise UserError(f'unknown message type {type_name!r}{hint}')
    text, _ = typestore().generate_msgdef(type_name, ros_version=2)
    return text, typestore().hash_rihs01(type_name)
