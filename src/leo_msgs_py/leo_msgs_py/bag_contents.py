# SPDX-License-Identifier: Apache-2.0
"""Everything in a bag: topics with their messages, metadata records, how it ended.

A bag is MCAP, or SQLite, rosbag2's other storage:

    topics(id, name, type, serialization_format, offered_qos_profiles, ...)
    messages(id, topic_id, timestamp, data)                  # timestamp = logged at [ns]

Source: rosbag2_storage_sqlite3, schema versions 1 to 4 (Foxy to Jazzy).
"""

from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
import sqlite3
from typing import Any, NamedTuple
from urllib.parse import quote

from mcap.records import Channel, Message, Metadata, Schema

from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.mcap_file import find_files, McapFile, refuse_many

SUFFIX = '.db3'
_HEADER = 100  # bytes of SQLite's own header (sqlite.org/fileformat2.html)
_TOPICS = 'SELECT id, name, type, serialization_format, offered_qos_profiles FROM topics'
_MESSAGES = 'SELECT topic_id, timestamp, data FROM messages'
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
    path: Path
    files: tuple[Path, ...]  # MCAP or SQLite, in order
    topics: Mapping[str, TopicLog]  # by name
    metadata: Mapping[str, Mapping[str, str]]  # records by name; `leo` is ours
    finished: bool  # every file has its footer
    damaged: int  # records that do not read and chunks that are not what was written, left out

    @property
    def message_count(self) -> int:
        return sum(len(topic.messages) for topic in self.topics.values())

    def of_type(self, type_name: str) -> tuple[TopicLog, ...]:
        return tuple(topic for topic in self.topics.values() if topic.type == type_name)


def robot_of(bag: Path, named: str = '') -> str:
    name = named or load(bag).metadata.get('leo', {}).get('robot', '')
    if not name:
        raise UserError(f'{bag} does not say which robot it is of; name it with --model')
    return name


def load(path: Path) -> BagContents:
    """Read a bag into memory, up to the cut where it is not finished; refuse what is none."""
    topics: dict[str, TopicLog] = {}
    metadata: dict[str, Mapping[str, str]] = {}
    files = find_databases(path)
    finished, damaged = True, sum(_load_database(file, topics) for file in files)
    if not files:
        files = find_files(path)
        read = [_load_file(McapFile(file), topics, metadata) for file in files]
        finished = all(file.finished for file in read)
        damaged = sum(file.damaged for file in read)
    for topic in topics.values():
        topic.messages.sort(key=lambda message: message.log_ns)
    return BagContents(path, files, topics, metadata, finished, damaged)


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
    published = message.publish_time if 0 < message.publish_time <= _LATEST else message.log_time
    return Logged(message.log_time, message.data, published)


def find_databases(path: Path) -> tuple[Path, ...]:
    """Return the .db3 files of a bag in recording order; none of a bag that has .mcap files."""
    if path.is_file():
        return (path,) if path.suffix == SUFFIX else ()
    if any(path.glob('*.mcap')):
        return ()
    files = (file for file in path.glob(f'*{SUFFIX}') if file.is_file())
    return tuple(sorted(files, key=lambda file: (len(file.name), file.name)))


def _load_database(path: Path, topics: dict[str, TopicLog]) -> int:
    """Add a SQLite file's messages; return how many rows are no message, 1 more if it is cut."""
    try:
        with closing(_opened(path)) as database:
            rows = database.execute(_TOPICS).fetchall()
            refuse_many(path, rows)
            return _load_messages(database, _channels(rows, topics))
    except (sqlite3.Error, ValueError, TypeError) as error:
        raise UserError(
            f'{path} is no rosbag2 SQLite file, or damaged: {one_line(error)}'
        ) from None


def _opened(path: Path) -> sqlite3.Connection:
    with path.open('rb') as stream:
        is_cut = _pages(stream.read(_HEADER))[0] > path.stat().st_size
    if is_cut:
        database = sqlite3.connect(':memory:')
        database.deserialize(_shortened(path.read_bytes()))
    else:
        database = sqlite3.connect(f'file:{quote(str(path.absolute()))}?mode=ro', uri=True)
    database.text_factory = lambda text: text.decode(errors='replace')
    return database


def _channels(rows: list[Any], topics: dict[str, TopicLog]) -> dict[int, list[Logged]]:
    channels = {}
    for number, *texts in rows:
        name, kind, encoding, qos = map(str, texts)
        if encoding == 'cdr':
            channels[int(number)] = topics.setdefault(name, TopicLog(name, kind, qos)).messages
    return channels


def _load_messages(database: sqlite3.Connection, channels: dict[int, list[Logged]]) -> int:
    rows, damaged = database.execute(_MESSAGES), 0
    while True:
        try:
            row = next(rows, None)
        except (sqlite3.Error, OverflowError):
            return damaged + 1
        if row is None:
            return damaged
        topic, log_ns, data = row
        if list(map(type, row)) != [int, int, bytes] or log_ns < 0:
            damaged += 1
        elif topic in channels:
            channels[topic].append(Logged(log_ns, data, log_ns))


def _pages(header: bytes) -> tuple[int, int]:
    """Return how long a database is by its header, and how long each of its pages [bytes]."""
    if len(header) < _HEADER or not header.startswith(b'SQLite format 3\0'):
        return 0, 1
    size = int.from_bytes(header[16:18], 'big')
    size = 65536 if size == 1 else size  # which two bytes cannot say
    return size * int.from_bytes(header[28:32], 'big'), size


def _shortened(data: bytes) -> bytes:
    _, size = _pages(data[:_HEADER])
    count = len(data) // max(size, 1)
    head = data[:18] + b'\1\1' + data[20:28] + count.to_bytes(4, 'big')
    return head + data[32 : count * size]
