# SPDX-License-Identifier: Apache-2.0
"""Logs as they are read before anything is known of them, and what is to be told of that."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from leo_sim.common.yaml_file import shown

from .csv_head import constants
from .expression import Table
from .join import are_parts, joined
from .json_log import json_content, places_of_rows
from .lerobot import is_lerobot
from .log_format import LogFormat
from .log_text import encoding_of, read_log_text, WINDOWS
from .tables import format_of, read_tables


def format_to_guess(log: Path) -> LogFormat:
    """Return how to read a log: of JSON, where its rows are."""
    if format_of(log, LogFormat()) != 'json':
        return LogFormat()
    return LogFormat(records=places_of_rows(json_content(log, LogFormat())))


def read_to_guess(
    paths: Sequence[Path], log_format: LogFormat, join: bool,
) -> tuple[list[Table], list[str]]:
    """Return the tables of the first log, or of all joined, and what is to be known of them."""
    tables, notes = read_tables(paths[0], log_format), _told_of(paths[0], log_format)
    if len(paths) > 1:
        read = [(paths[0], tables), *((log, read_tables(log, log_format)) for log in paths[1:])]
        if join or are_parts(paths, [each[0] for _, each in read]):
            both = joined(read)
            return both.tables, [both.told, *notes]
    return tables, notes


def _told_of(log: Path, log_format: LogFormat) -> list[str]:
    """Return what is to be known of how a log was read."""
    if is_lerobot(log) or format_of(log, log_format) not in ('csv', 'txt'):
        return []
    code = encoding_of(log)
    notes = [f'read as {code}: it is no UTF-8'] if code == WINDOWS else []
    found = constants(read_log_text(log).splitlines())
    if found:
        listed = ', '.join(f'{shown(name)[1:-1]} = {constant.value:.6g} {constant.unit}'.rstrip()
                           for name, constant in found.items())
        notes.append(f'its comments say {listed}: columns of one value; where the robot has it: '
                     'constants: {links.LINK.mass: {column: mass, unit: kg}}')
    return notes
