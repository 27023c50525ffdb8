# SPDX-License-Identifier: Apache-2.0
"""Logs as tables: CSV rows, JSON records, MATLAB arrays, LeRobot frames; one for each episode."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import entry_points
import inspect
from pathlib import Path

from leo_msgs_py.errors import UserError
from leo_sim.common.user_code import guarded
from leo_sim.common.yaml_file import shown

from .csv_log import CSV
from .expression import Table
from .json_log import JSON
from .lerobot import LEROBOT
from .log_format import LogFormat, Reader
from .mat_log import MAT

READERS = CSV, JSON, MAT, LEROBOT
GROUP = 'leo.log_formats'
"""Entry points by which other packages register a `Reader`."""


def read_tables(log: Path, log_format: LogFormat) -> list[Table]:
    """Return the tables of a log, one per episode, each with at least one column.

    Raises:
        UserError: no such file, an unknown format, or not a log as the map says.
    """
    tables = reader_of(log, log_format).read(log, log_format)
    if not tables or not all(tables):
        raise UserError(f'{log} has no columns of numbers')
    return tables


def reader_of(log: Path, log_format: LogFormat) -> Reader:
    """Return what reads a log: what the map says, else what its name ends in.

    Raises:
        UserError: no such file, an unknown format, or a folder that is no LeRobot data set.
    """
    for reader in READERS:
        if reader.takes(log, log_format):
            return reader
    others = [_foreign(entry.load()) for entry in entry_points(group=GROUP)]
    for reader in others:
        if reader.takes(log, log_format):
            return reader
    if log.is_dir():
        raise UserError(
            f'{log} is a folder without meta/info.json, so no LeRobot data set; name files'
        )
    if not log.is_file():
        raise UserError(f'no log {log}')
    name = log_format.format or log.suffix.lower().lstrip('.')
    *names, last = [reader.name for reader in (*READERS, *others) if reader.endings]
    raise UserError(
        f'{log}: unknown format {shown(name)}; name one (format: {", ".join(names)} or {last})'
    )


def _foreign(reader: Reader) -> Reader:
    """Return a reader of another package, whose errors are one line with their place."""
    file = Path(inspect.getfile(reader.read))
    return replace(reader, read=guarded(file, 'log format', reader.read))
