# SPDX-License-Identifier: Apache-2.0
"""What a replayed bag holds: states, applied inputs and episodes, in the order of recording."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
import zlib

from mcap.exceptions import McapError
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_msgs_py.wire.types import deserialize

STATES = ('joint_states', 'sensor_msgs/msg/JointState')
APPLIED = ('dynamic_joint_states', 'control_msgs/msg/DynamicJointState')
EPISODE = ('robot/episode', 'std_msgs/msg/UInt32')


@dataclass(frozen=True)
class Moment:
    """One recorded state, the input in force at it, and the episode's number."""

    state: JointStates
    applied: Applied | None
    episode: int


def read_moments(path: Path) -> list[Moment]:
    """Every state of a bag (a rosbag2 folder or one .mcap) once; repeats are left out.

    Raises:
        UserError: no such bag, no MCAP in it, or no joint states (listing the topics it has).
    """
    states: list[tuple[JointStates, int]] = []
    inputs: dict[int, Applied] = {}
    episode, found = 0, set[str]()
    for kind, data in _messages(_files(path), found):
        message: Any = deserialize(data, kind)
        if kind == EPISODE[1]:
            episode = int(message.data)
        elif kind == APPLIED[1]:
            applied = Applied.from_message(message)
            inputs[applied.stamp_ns] = applied
        else:
            state = JointStates.from_message(message)
            if not states or state.stamp_ns != states[-1][0].stamp_ns:
                states.append((state, episode))
    if not states:
        raise UserError(f'{path} has no /joint_states; it has {sorted(found) or "no topics"}')
    stamps = sorted(inputs)
    return [
        Moment(state, _latest(inputs, stamps, state.stamp_ns), number) for state, number in states
    ]


def _latest(inputs: dict[int, Applied], stamps: list[int], now: int) -> Applied | None:
    before = bisect_right(stamps, now)
    return inputs[stamps[before - 1]] if before else None


def _files(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise UserError(f'no bag {path}; give a rosbag2 folder or an .mcap file: -p bag:=BAG')
    if not (files := sorted(path.glob('*.mcap'))):
        raise UserError(f'{path} holds no .mcap file; only MCAP bags can be replayed')
    return files


def _messages(files: list[Path], found: set[str]) -> Iterator[tuple[str, bytes]]:
    """Type and CDR bytes of the wanted messages; adds every topic it meets to `found`."""
    for file in files:
        types: dict[int, str] = {}
        schemas: dict[int, str] = {}
        for record in _records(file):
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                found.add(record.topic)
                kind = schemas.get(record.schema_id, '')
                if any(
                    record.topic.endswith(f'/{t}') and kind == k
                    for t, k in (STATES, APPLIED, EPISODE)
                ):
                    types[record.id] = kind
            elif isinstance(record, Message) and record.channel_id in types:
                yield types[record.channel_id], record.data


def _records(file: Path) -> Iterator[Any]:
    """Records of a file, up to the cut where the recorder was killed."""
    with file.open('rb') as stream:
        try:
            yield from StreamReader(stream, record_size_limit=file.stat().st_size + 1).records
        except (McapError, zlib.error, EOFError):
            return
