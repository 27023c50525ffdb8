# SPDX-License-Identifier: Apache-2.0
"""Everything in a bag: topics with their messages, metadata records, how it ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from mcap.records import Channel, Message, Metadata, Schema

from leo_msgs_py.mcap_file import find_files, McapFile

from .db3 import Db3File, find_databases, StoredTopic

_LATEST = 2**63 - 1


class Logged(NamedTuple):
    """One message: when it was logged [ns], its CDR bytes, when it was published [ns]."""

    log_ns: int
    data: bytes
    published_ns: int


@dataclass
class TopicLog:
    """All messages of one topic in log order; `broken` counts those found undecodable."""

    name: str
    type: str
    qos: str = ''
    messages: list[Logged] = field(default_factory=list)
    broken: int = 0


@dataclass(frozen=True)
class BagContents:
    """A bag in memory.

    Attributes:
        path: the folder or file that was asked for.
        files: its MCAP (or SQLite) files in order.
        topics: by name.
        metadata: metadata records by name; `leo` is ours.
        finished: whether every file has its footer.
        damaged: records that do not read, and chunks that are not what was written; left out.
    """

    path: Path
    files: tuple[Path, ...]
    topics: Mapping[str, TopicLog]
    metadata: Mapping[str, Mapping[str, str]]
    finished: bool
    damaged: int

    @property
    def message_count(self) -> int:
        """Number of messages over all topics."""
        return sum(len(topic.messages) for topic in self.topics.values())

    def of_type(self, type_name: str) -> tuple[TopicLog, ...]:
        """Return the topics of a message type."""
        return tuple(topic for topic in self.topics.values() if topic.type == type_name)


def load(path: Path) -> BagContents:
    """Read a bag into memory, up to the cut where it is not finished; refuse what is none."""
    topics: dict[str, TopicLog] = {}
    metadata: dict[str, Mapping[str, str]] = {}
    files = find_databases(path)
    finished, damaged = True, sum(_load_database(Db3File(file), topics) for file in files)
    if not files:
        files = find_files(path)
        read = [_load_file(McapFile(file), topics, metadata) for file in files]
        finished = all(file.finished for file in read)
        damaged = sum(file.damaged for file in read)
    for topic in topics.values():
        topic.messages.sort(key=lambda message: message.log_ns)
    return BagContents(path, files, topics, metadata, finished, damaged)


def _load_database(file: Db3File, topics: dict[str, TopicLog]) -> int:
    """Add what a SQLite file holds in CDR; return how much of it was damaged."""
    channels: dict[int, list[Logged]] = {}
    for row in file.records():
        if isinstance(row, StoredTopic):
            if row.encoding == 'cdr':
                log = TopicLog(row.name, row.type, row.qos)
                channels[row.number] = topics.setdefault(row.name, log).messages
            continue
        topic, log_ns, data = row
        if log_ns < 0:
            file.damaged += 1
        elif topic in channels:
            channels[topic].append(Logged(log_ns, data, log_ns))
    return file.damaged


def _load_file(
    file: McapFile, topics: dict[str, TopicLog], metadata: dict[str, Mapping[str, str]]
) -> McapFile:
    schemas: dict[int, str] = {}
    channels: dict[int, list[Logged]] = {}
    for record in file.records():
        if isinstance(record, Message):
            if record.channel_id in channels and record.log_time <= _LATEST:
                channels[record.channel_id].append(logged(record))
            else:
                file.damaged += 1
        elif isinstance(record, Schema):
            schemas[record.id] = record.name
        elif isinstance(record, Channel):
            kind = schemas.get(record.schema_id, '')
            log = TopicLog(record.topic, kind, record.metadata.get('offered_qos_profiles', ''))
            channels[record.id] = topics.setdefault(record.topic, log).messages
        elif isinstance(record, Metadata):
            metadata[record.name] = record.metadata
    return file


def logged(message: Message) -> Logged:
    """Take what counts of a record; its log time where it does not say when it was published."""
    published = message.publish_time if 0 < message.publish_time <= _LATEST else message.log_time
    return Logged(message.log_time, message.data, published)
