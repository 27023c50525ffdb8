# SPDX-License-Identifier: Apache-2.0
"""Bags in rosbag2's other storage, SQLite: its .db3 files as rows of topics and messages.

    topics(id, name, type, serialization_format, offered_qos_profiles, ...)
    messages(id, topic_id, timestamp, data)                  # timestamp = logged at [ns]

Source: rosbag2_storage_sqlite3, schema versions 1 to 4 (Foxy to Jazzy).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
import sqlite3
from typing import NamedTuple
from urllib.parse import quote

from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.mcap_file import refuse_many

SUFFIX = '.db3'
_HEADER = 100
"""Bytes of SQLite's own header (sqlite.org/fileformat2.html)."""
_TOPICS = 'SELECT id, name, type, serialization_format, offered_qos_profiles FROM topics'
_MESSAGES = 'SELECT topic_id, timestamp, data FROM messages'


StoredMessage = tuple[int, int, bytes]
"""One row of `messages`: its topic, when it was logged [ns], its CDR bytes."""


class StoredTopic(NamedTuple):
    """One row of `topics`."""

    number: int
    name: str
    type: str
    encoding: str
    qos: str


def find_databases(path: Path) -> tuple[Path, ...]:
    """Return the .db3 files of a bag in recording order; none of a bag that has .mcap files."""
    if path.is_file():
        return (path,) if path.suffix == SUFFIX else ()
    if any(path.glob('*.mcap')):
        return ()
    files = (file for file in path.glob(f'*{SUFFIX}') if file.is_file())
    return tuple(sorted(files, key=lambda file: (len(file.name), file.name)))


class Db3File:
    """The topics and messages of one file; reading ends where the file is damaged, or cut.

    Attributes:
        damaged: rows that are no message, and ends of files.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damaged = 0

    def records(self) -> Iterator[StoredTopic | StoredMessage]:
        """Yield the topics, then the messages.

        Raises:
            UserError: not a rosbag2 SQLite file, or one of too many topics.
        """
        try:
            with closing(self._opened()) as database:
                topics = database.execute(_TOPICS).fetchall()
                refuse_many(self.path, topics)
                for row in topics:
                    yield StoredTopic(int(row[0]), *map(str, row[1:]))
                yield from self._messages(database)
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise UserError(
                f'{self.path} is no rosbag2 SQLite file, or damaged: {one_line(error)}'
            ) from None

    def _opened(self) -> sqlite3.Connection:
        """Open the file to read it; what a killed recorder left in its -wal is read, too."""
        with self.path.open('rb') as stream:
            is_cut = _pages(stream.read(_HEADER))[0] > self.path.stat().st_size
        if is_cut:
            database = sqlite3.connect(':memory:')
            database.deserialize(_shortened(self.path.read_bytes()))
        else:
            place = quote(str(self.path.absolute()))
            database = sqlite3.connect(f'file:{place}?mode=ro', uri=True)
        database.text_factory = lambda text: text.decode(errors='replace')
        return database

    def _messages(self, database: sqlite3.Connection) -> Iterator[StoredMessage]:
        rows = database.execute(_MESSAGES)
        while True:
            try:
                row = next(rows, None)
            except (sqlite3.Error, OverflowError):
                self.damaged += 1
                return
            if row is None:
                return
            if list(map(type, row)) == [int, int, bytes]:
                yield row
            else:
                self.damaged += 1


def _pages(header: bytes) -> tuple[int, int]:
    """Return how long a database is by its header, and how long each of its pages [bytes]."""
    if len(header) < _HEADER or not header.startswith(b'SQLite format 3\0'):
        return 0, 1
    size = int.from_bytes(header[16:18], 'big')
    size = 65536 if size == 1 else size  # which two bytes cannot say
    return size * int.from_bytes(header[28:32], 'big'), size


def _shortened(data: bytes) -> bytes:
    """Return a database that was cut as one of the pages that are left, without a log beside."""
    _, size = _pages(data[:_HEADER])
    count = len(data) // max(size, 1)
    head = data[:18] + b'\1\1' + data[20:28] + count.to_bytes(4, 'big')
    return head + data[32 : count * size]
