# SPDX-License-Identifier: Apache-2.0
"""Position goals as others send them: trajectories, and what their controllers say they follow."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
import struct
from typing import Any, NamedTuple

import numpy as np
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from rosbags.typesys.store import Typestore

from .contents import BagContents, Logged, TopicLog
from .states import deserialize, Floats, stamp_of, Stamps
from .topic_map import find_topic, Role, TopicMap, TYPES
from .types import TRAJECTORY

_FOLLOWS = 'leo_msgs/msg/Followed'
_FOLLOWED = (
    'std_msgs/Header header\nstring[] joint_names\n'
    'trajectory_msgs/JointTrajectoryPoint reference\n'
)
"""How control_msgs/JointTrajectoryControllerState begins, in every version: its third field
is the set point, `desired` up to Galactic and `reference` from Humble on; what follows differs."""


class Asked(NamedTuple):
    """What one message asks.

    Attributes:
        log_ns: when it was recorded.
        stamp_ns: from when on it counts by its header; 0 for as soon as it comes.
        names: of the joints, n of them.
        after_ns: when after that they are to be there, shape (K,), increasing.
        goals: rad (m), shape (K, n).
    """

    log_ns: int
    stamp_ns: int
    names: tuple[str, ...]
    after_ns: Stamps
    goals: Floats


def goal_topics(contents: BagContents, role: Role, topic_map: TopicMap) -> list[TopicLog]:
    """The topics of a role, the one that the map names or all of its type, by name."""
    if role in topic_map.topics:
        named = find_topic(contents, role, topic_map)
        return [] if named is None else [named]
    found = (topic for topic in contents.of_type(TYPES[role]) if topic.messages)
    return sorted(found, key=lambda topic: topic.name)


def asked(topic: TopicLog) -> list[Asked]:
    """What the messages of a topic of trajectories or controller states ask, those with a goal."""
    read = _trajectories if topic.type == TRAJECTORY else _followed
    return list(read(topic))


def _trajectories(topic: TopicLog) -> Iterator[Asked]:
    for logged, message in deserialize(topic, topic.type):
        names = tuple(message.joint_names)
        points = [p for p in message.points if names and len(p.positions) == len(names)]
        after = np.array([_nanoseconds(p.time_from_start) for p in points], dtype=np.int64)
        goals = np.array([p.positions for p in points], dtype=float)
        if points and np.isfinite(goals).all() and (np.diff(after) > 0).all():
            yield Asked(logged.log_ns, stamp_of(message), names, after, goals)


def _followed(topic: TopicLog) -> Iterator[Asked]:
    topic.broken = 0
    for logged in topic.messages:
        message = _begin_of(logged)
        if message is None:
            topic.broken += 1
            continue
        names, goal = tuple(message.joint_names), message.reference.positions
        if names and len(goal) == len(names) and np.isfinite(goal).all():
            now = np.zeros(1, dtype=np.int64)
            yield Asked(logged.log_ns, stamp_of(message), names, now, np.array([goal]))


def _nanoseconds(duration: Any) -> int:
    return int(duration.sec) * 1_000_000_000 + int(duration.nanosec)


@cache
def _store() -> Typestore:
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(_FOLLOWED, _FOLLOWS))
    return store


def _begin_of(logged: Logged) -> Any | None:
    """The begin of a controller's state, up to its set point; None where it does not decode."""
    data, kind = logged.data, _store().get_msgdef(_FOLLOWS)
    if len(data) < 4 or data[:2] not in (b'\x00\x00', b'\x00\x01'):
        return None
    read = kind.deserialize_cdr_le if data[1] else kind.deserialize_cdr_be
    try:
        return read(memoryview(data)[4:], 0, kind.cls, _store())[0]
    except (struct.error, UnicodeDecodeError, ValueError):
        return None
