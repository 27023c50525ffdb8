# SPDX-License-Identifier: Apache-2.0
"""Finishing bags that a killed recorder left without an index."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
import fcntl
import os
from pathlib import Path
from typing import IO

from mcap.records import Channel, McapRecord, Message, Metadata, Schema
from mcap.writer import CompressionType, MCAP0_MAGIC, Writer

from leo_msgs_py.mcap_file import DAMAGE, find_files, McapFile

from .db3 import find_databases
from .metadata import write_metadata

_FOOTER_SIZE = 9 + 20 + 8


class BagState(Enum):
    """How a bag was found."""

    FINISHED = 'finished'
    REPAIRED = 'repaired'
    RECORDING = 'recording'
    DAMAGED = 'damaged'


def finish_bag(path: Path) -> BagState:
    """Give an unfinished bag its index and metadata.yaml; leave all others as they are.

    Of a single .mcap only the index is made. A bag that another process is writing is left
    alone, and so is one that is damaged. Each file is replaced in one step, by a copy that is
    already on disk: a kill while finishing loses nothing.

    Raises:
        UserError: there is no bag at `path`.
        OSError: the folder is read-only, or the disk full.
    """
    if find_databases(path):  # a database needs no index of ours
        return BagState.FINISHED
    files = find_files(path)
    states = [_finish_file(file) for file in files]
    for state in (BagState.RECORDING, BagState.DAMAGED):
        if state in states:
            return state
    repaired = BagState.REPAIRED in states
    if path.is_dir() and (repaired or not (path / 'metadata.yaml').exists()):
        return BagState.REPAIRED if _described(path) else BagState.DAMAGED
    return BagState.REPAIRED if repaired else BagState.FINISHED


def _described(folder: Path) -> bool:
    """Write metadata.yaml; say whether the summaries of the files could be read for it."""
    try:
        write_metadata(folder)
    except DAMAGE:
        return False
    return True


def is_finished(file: Path) -> bool:
    """Say whether an MCAP file ends in a footer."""
    with file.open('rb') as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - _FOOTER_SIZE, 0))
        end = stream.read()
    return len(end) == _FOOTER_SIZE and end[0] == 2 and end.endswith(MCAP0_MAGIC)


def is_recording(file: Path) -> bool:
    """Say whether a process is writing an MCAP file now."""
    with file.open('rb') as stream, _lock(stream) as ours:
        return not ours


def _finish_file(file: Path) -> BagState:
    with file.open('rb') as stream, _lock(stream) as ours:
        if not ours:
            return BagState.RECORDING
        if is_finished(file):
            return BagState.FINISHED
        temporary = file.with_name(f'.{file.name}.finishing')
        try:
            if not _copy(file, temporary):
                return BagState.DAMAGED
            os.replace(temporary, file)
            return BagState.REPAIRED
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def _lock(stream: IO[bytes]) -> Iterator[bool]:
    """Yield whether the file could be locked: a writer holds the lock as long as it lives."""
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        yield False
    else:
        yield True
        fcntl.flock(stream, fcntl.LOCK_UN)


def _copy(source: Path, target: Path) -> bool:
    """Copy every whole record to a new, indexed file and wait until it is on disk.

    Returns:
        Whether all that is there could be read.
    """
    file = McapFile(source)
    with target.open('wb') as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start(profile='ros2', library='leo_diffmodel')
        _Copier(writer).copy(file.records())
        writer.finish()
        stream.flush()
        os.fsync(stream.fileno())
    return not file.damaged


class _Copier:
    """Copies records between files, renumbering schemas and channels."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas = {0: 0}
        self._channels: dict[int, int] = {}

    def copy(self, records: Iterator[McapRecord]) -> None:
        for record in records:
            if isinstance(record, Message) and record.channel_id in self._channels:
                self._writer.add_message(
                    self._channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
            elif isinstance(record, Channel) and record.id not in self._channels:
                self._channels[record.id] = self._writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    self._schemas.get(record.schema_id, 0),
                    record.metadata,
                )
            elif isinstance(record, Schema) and record.id not in self._schemas:
                self._schemas[record.id] = self._writer.register_schema(
                    record.name, record.encoding, record.data
                )
            elif isinstance(record, Metadata):
                self._writer.add_metadata(record.name, record.metadata)
