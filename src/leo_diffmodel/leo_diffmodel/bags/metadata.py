# SPDX-License-Identifier: Apache-2.0
"""metadata.yaml of a rosbag2 folder (version 9), made from its finished MCAP files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Statistics
from mcap.summary import Summary
import yaml

from leo_msgs_py.mcap_file import find_files, refuse_many
from leo_msgs_py.whole_file import write_whole

from .qos_text import profiles


def write_metadata(folder: Path) -> Path:
    """Write metadata.yaml of a bag in one step and return its path.

    Raises:
        McapError, ...: a summary does not read (`mcap_file.DAMAGE`).
        UserError: one has too many topics.
    """
    files = find_files(folder)
    summaries = [_summary(file) for file in files]
    content = {'rosbag2_bagfile_information': _information(files, summaries)}
    return write_whole(folder / 'metadata.yaml', yaml.safe_dump(content, sort_keys=False))


def _summary(file: Path) -> tuple[Summary, Statistics]:
    with file.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    if summary is None or summary.statistics is None:
        raise McapError(f'{file} has no summary')
    refuse_many(file, summary.channels)
    return summary, summary.statistics


def _information(
    files: tuple[Path, ...], summaries: list[tuple[Summary, Statistics]]
) -> dict[str, Any]:
    statistics = [s for _, s in summaries]
    filled = [s for s in statistics if s.message_count]
    start = min((s.message_start_time for s in filled), default=0)
    end = max((s.message_end_time for s in filled), default=0)
    return {
        'version': 9,
        'storage_identifier': 'mcap',
        'duration': {'nanoseconds': end - start},
        'starting_time': {'nanoseconds_since_epoch': start},
        'message_count': sum(s.message_count for s in statistics),
        'topics_with_message_count': _topics(summaries),
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [file.name for file in files],
        'files': [_file(file, s) for file, s in zip(files, statistics, strict=True)],
        'custom_data': None,
        'ros_distro': 'jazzy',
    }


def _file(file: Path, statistics: Statistics) -> dict[str, Any]:
    start, end = statistics.message_start_time, statistics.message_end_time
    return {
        'path': file.name,
        'starting_time': {'nanoseconds_since_epoch': start},
        'duration': {'nanoseconds': end - start},
        'message_count': statistics.message_count,
    }


def _topics(summaries: list[tuple[Summary, Statistics]]) -> list[dict[str, Any]]:
    """Return the topics with their message counts over all files."""
    topics: dict[str, dict[str, Any]] = {}
    for summary, statistics in summaries:
        for channel in summary.channels.values():
            count = statistics.channel_message_counts.get(channel.id, 0)
            if channel.topic in topics:
                topics[channel.topic]['message_count'] += count
            else:
                metadata = {
                    'name': channel.topic,
                    'type': summary.schemas[channel.schema_id].name,
                    'serialization_format': channel.message_encoding,
                    'offered_qos_profiles': profiles(
                        channel.metadata.get('offered_qos_profiles', '')
                    ),
                    'type_description_hash': channel.metadata.get('topic_type_hash', ''),
                }
                topics[channel.topic] = {'topic_metadata': metadata, 'message_count': count}
    return list(topics.values())
