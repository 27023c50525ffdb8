# SPDX-License-Identifier: Apache-2.0
"""Logs as tables: CSV rows, JSON records, MATLAB arrays, LeRobot frames; one for each episode."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from leo_msgs_py.errors import UserError

from .csv_log import read_csv
from .expression import Table
from .json_log import read_json
from .lerobot import is_lerobot, read_lerobot
from .log_format import LogFormat
from .mat_log import read_mat


def read_tables(log: Path, log_format: LogFormat) -> list[Table]:
    """Return the tables of a log, one per episode, each with at least one column.

    Raises:
        UserError: no such file, an unknown format, or not a log as the map says.
    """
    readers: dict[str, Callable[[Path, LogFormat], list[Table]]] = {
        'csv': read_csv, 'txt': read_csv, 'json': read_json, 'mat': read_mat,
        'lerobot': read_lerobot,
    }
    name = format_of(log, log_format)
    if name not in readers:
        raise UserError(f'{log}: unknown format {name!r}; name one (format: csv, json or mat)')
    tables = readers[name](log, log_format)
    if not tables or not all(tables):
        raise UserError(f'{log} has no columns of numbers')
    return tables


def format_of(log: Path, log_format: LogFormat) -> str:
    """Return the format of a log: what the map says, else what its name ends in.

    Raises:
        UserError: no such file, or a folder that is no LeRobot data set.
    """
    if is_lerobot(log):
        return 'lerobot'
    if log.is_dir():
        raise UserError(f'{log} is a folder without meta/info.json, so no LeRobot data set; '
                        'name files')
    if not log.is_file():
        raise UserError(f'no log {log}')
    return log_format.format or log.suffix.lower().lstrip('.')[:9]
