# SPDX-License-Identifier: Apache-2.0
"""What makes a bag whole: an index, also where a recorder was killed, and metadata.yaml."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from enum import Enum
import fcntl
import os
from pathlib import Path
from typing import Any, IO

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, McapRecord, Message, Metadata, Schema, Statistics
from mcap.summary import Summary
from mcap.writer import CompressionType, MCAP0_MAGIC, Writer
import yaml

from leo_msgs_py.bag_contents import find_databases
from leo_msgs_py.mcap_file import DAMAGE, find_files, McapFile, refuse_many
from leo_msgs_py.whole_file import write_whole

from .types import profiles

_FOOTER_SIZE = 9 + 20 + 8


class BagState(Enum):
    FINISHED = 'finished'
    REPAIRED = 'repaired'
    RECORDING = 'recording'
    DAMAGED = 'damaged'


def finish_bag(path: Path) -> BagState:
    """Give an unfinished bag its index and metadata.yaml; leave all others as they are.

    Of a single .mcap only the index is made. One that is being written, or damaged, is left alone.
    Each file is replaced in one step: a kill while finishing loses nothing.
    """
    if find_databases(path):  # a database needs no index of ours
        return BagState.FINISHED
    states = {_finish_file(file) for file in find_files(path)}
    for state in (BagState.RECORDING, BagState.DAMAGED):
        if state in states:
            return state
    repaired = BagState.REPAIRED in states
    if path.is_dir() and (repaired or not (path / 'metadata.yaml').exists()):
        try:
            write_metadata(path)
        except DAMAGE:  # the summary of a file does not read
            return BagState.DAMAGED
        return BagState.REPAIRED
    return BagState.REPAIRED if repaired else BagState.FINISHED


def finish_left_over(base: Path) -> list[Path]:
    found = []
    for bag in recorded(base):
        with suppress(OSError):
            if finish_bag(bag) is BagState.REPAIRED:
                found.append(bag)
    return found


def recorded(base: Path) -> list[Path]:
    folders = [base, *sorted(base.parent.glob(f'{base.name}_*'))]
    return [folder for folder in folders if folder.is_dir() and any(folder.glob('*.mcap'))]


def is_finished(file: Path) -> bool:
    with file.open('rb') as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - _FOOTER_SIZE, 0))
        end = stream.read()
    return len(end) == _FOOTER_SIZE and end[0] == 2 and end.endswith(MCAP0_MAGIC)


def is_recording(file: Path) -> bool:
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
    file = McapFile(source)
    with target.open('wb') as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start(profile='ros2', library='leo_diffmodel')
        _copy_records(file.records(), writer)
        writer.finish()
        stream.flush()
        os.fsync(stream.fileno())
    return not file.damaged


def _copy_records(records: Iterator[McapRecord], writer: Writer) -> None:
    """Copy records to another file, which numbers its schemas and channels anew."""
    schemas, channels = {0: 0}, dict[int, int]()
    for r in records:
        if isinstance(r, Message) and r.channel_id in channels:
            channel = channels[r.channel_id]
            writer.add_message(channel, r.log_time, r.data, r.publish_time, r.sequence)
        elif isinstance(r, Channel) and r.id not in channels:
            facts = r.topic, r.message_encoding, schemas.get(r.schema_id, 0), r.metadata
            channels[r.id] = writer.register_channel(*facts)
        elif isinstance(r, Schema) and r.id not in schemas:
            schemas[r.id] = writer.register_schema(r.name, r.encoding, r.data)
        elif isinstance(r, Metadata):
            writer.add_metadata(r.name, r.metadata)


def write_metadata(folder: Path) -> Path:
    """Write metadata.yaml of a bag in one step; raises `mcap_file.DAMAGE` of a bad summary."""
    summaries = {file: _summary(file) for file in find_files(folder)}
    content = {'rosbag2_bagfile_information': _information(summaries)}
    return write_whole(folder / 'metadata.yaml', yaml.safe_dump(content, sort_keys=False))


def _summary(file: Path) -> tuple[Summary, Statistics]:
    with file.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    if summary is None or summary.statistics is None:
        raise McapError(f'{file} has no summary')
    refuse_many(file, summary.channels)
    return summary, summary.statistics


def _information(summaries: Mapping[Path, tuple[Summary, Statistics]]) -> dict[str, Any]:
    statistics = [s for _, s in summaries.values()]
    filled = [s for s in statistics if s.message_count]
    start = min((s.message_start_time for s in filled), default=0)
    end = max((s.message_end_time for s in filled), default=0)
    return {
        'version': 9,
        'storage_identifier': 'mcap',
        **_extent(start, end, sum(s.message_count for s in statistics)),
        'topics_with_message_count': _topics(summaries.values()),
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [file.name for file in summaries],
        'files': [
            {'path': file.name}
            | _extent(s.message_start_time, s.message_end_time, s.message_count)
            for file, (_, s) in summaries.items()
        ],
        'custom_data': None,
        'ros_distro': 'jazzy',
    }


def _extent(start: int, end: int, count: int) -> dict[str, Any]:
    return {
        'starting_time': {'nanoseconds_since_epoch': start},
        'duration': {'nanoseconds': end - start},
        'message_count': count,
    }


def _topics(summaries: Iterable[tuple[Summary, Statistics]]) -> list[dict[str, Any]]:
    topics: dict[str, dict[str, Any]] = {}
    for summary, statistics in summaries:
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)  # of some encodings there is none
            metadata = {
                'name': channel.topic,
                'type': schema.name if schema else '',
                'serialization_format': channel.message_encoding,
                'offered_qos_profiles': profiles(channel.metadata.get('offered_qos_profiles', '')),
                'type_description_hash': channel.metadata.get('topic_type_hash', ''),
            }
            first = {'topic_metadata': metadata, 'message_count': 0}
            count = statistics.channel_message_counts.get(channel.id, 0)
            topics.setdefault(channel.topic, first)['message_count'] += count
    return list(topics.values())
