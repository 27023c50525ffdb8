# SPDX-License-Identifier: Apache-2.0
"""What a replayed bag holds: states, applied inputs and episodes, in the order of recording."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
import sys
from typing import Any

from mcap.records import Channel, Message, Schema
from rosbags.serde import SerdeError

from leo_msgs_py.cdr import decode
from leo_msgs_py.errors import UserError
from leo_msgs_py.mcap_file import find_files, McapFile
from leo_msgs_py.values import Applied, JointStates

STATES, EPISODE = '/joint_states', '/robot/episode'
DYNAMIC = '/dynamic_joint_states'
"""What was applied, in bags of ros2_control robots and in those of before 2026-12."""


@dataclass(frozen=True)
class Moment:
    """One recorded state, the input in force at it, and the episode's number."""

    state: JointStates
    applied: Applied | None
    episode: int


def read_moments(path: Path, interface: str) -> list[Moment]:
    """Every state of a bag (a rosbag2 folder or one .mcap) once; repeats are left out.

    Args:
        path: the bag.
        interface: 'voltage', 'effort' or 'position', the unit of the inputs that count.

    Raises:
        UserError: no such bag, no MCAP in it, or no joint states (listing the topics it has).
    """
    states: list[tuple[JointStates, int]] = []
    applied = f'/robot/applied_{interface}'
    inputs: dict[str, dict[int, Applied]] = {applied: {}, DYNAMIC: {}}
    episode, found = 0, set[str]()
    for name, message in _messages(find_files(path), applied, found):
        if name == EPISODE:
            episode = int(message.data)
        elif name == STATES:
            state = JointStates.from_message(message)
            if not states or state.stamp_ns != states[-1][0].stamp_ns:
                states.append((state, episode))
        else:
            read = Applied.from_dynamic if name == DYNAMIC else Applied.from_message
            with suppress(UserError):  # of other joints, or not known
                value = read(message, interface)
                inputs[name][value.stamp_ns] = value
    if not states:
        raise UserError(f'{path} has no /joint_states; it has {sorted(found) or "no topics"}')
    # positions among the dynamic joint states are measured ones, no goals
    known = inputs[applied] or ({} if interface == 'position' else inputs[DYNAMIC])
    stamps = sorted(known)
    return [
        Moment(state, _latest(known, stamps, state.stamp_ns), number) for state, number in states
    ]


def _latest(inputs: dict[int, Applied], stamps: list[int], now: int) -> Applied | None:
    before = bisect_right(stamps, now)
    return inputs[stamps[before - 1]] if before else None


def _messages(files: Iterable[Path], applied: str, found: set[str]) -> Iterator[tuple[str, Any]]:
    """Wanted topics and their messages that decode; adds every topic it meets to `found`.

    Around what is damaged the rest is read, and stderr told how much it was.
    """
    types = {
        STATES: 'sensor_msgs/msg/JointState',
        applied: 'sensor_msgs/msg/JointState',
        DYNAMIC: 'control_msgs/msg/DynamicJointState',
        EPISODE: 'std_msgs/msg/UInt32',
    }
    for file in map(McapFile, files):
        topics: dict[int, str] = {}
        schemas: dict[int, str] = {}
        for record in file.records():
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                found.add(record.topic)
                for name, kind in types.items():
                    if record.topic.endswith(name) and schemas.get(record.schema_id) == kind:
                        topics[record.id] = name
            elif isinstance(record, Message) and record.channel_id in topics:
                name = topics[record.channel_id]
                with suppress(SerdeError):
                    yield name, decode(record.data, types[name])
        if file.damaged:
            print(f'{file.path}: {file.damaged} damaged records are left out', file=sys.stderr)
