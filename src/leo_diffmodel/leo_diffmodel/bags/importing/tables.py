# SPDX-License-Identifier: Apache-2.0
"""Logs of any format as tables, one for each episode."""

from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import entry_points, EntryPoint
import inspect
from itertools import chain
from pathlib import Path

from leo_msgs_py.errors import UserError
from leo_sim.common.user_code import guarded
from leo_sim.common.yaml_file import shown

from .column_map import ColumnMap
from .csv_log import CSV
from .expression import evaluate
from .groups_log import HDF5, MAT, NUMPY, ZARR
from .join import are_parts, joined
from .json_log import JSON, JSON_LINES
from .lerobot import is_lerobot, LEROBOT
from .log_format import ending_of, LogFormat, Reader, refuse_bag, Table, without_infinite
from .message_log import MCAP, ROS1
from .parquet_log import PARQUET

READERS = CSV, JSON, JSON_LINES, MAT, NUMPY, HDF5, ZARR, PARQUET, MCAP, ROS1, LEROBOT
GROUP = 'leo.log_formats'  # entry points by which other packages register a `Reader`
BAGS = {'mcap', 'db3'}
REFUSED = {
    'is a spreadsheet; save it as CSV and import that': 'xlsx xls xlsm xlsb ods numbers',
    'is a pickle, which can run code as it is read; save np.savez(FILE, t=t, q=q)': 'pkl pickle',
}


def read_tables(log: Path, log_format: LogFormat) -> list[Table]:
    tables = reader_of(log, log_format).read(log, log_format)
    if not tables or not all(tables):
        raise UserError(f'{log} has no columns of numbers')
    return [{name: without_infinite(column) for name, column in t.items()} for t in tables]


def reader_of(log: Path, log_format: LogFormat) -> Reader:
    tried = []
    for reader in chain(READERS, map(_foreign, entry_points(group=GROUP))):
        if reader.takes(log, log_format):
            return reader
        tried.append(reader)
    _refuse_unread(log)
    name = log_format.format or ending_of(log)
    *names, last = [reader.name for reader in tried if reader.endings]
    raise UserError(
        f'{log}: unknown format {shown(name)}; name one (format: {", ".join(names)} or {last})'
    )


def _refuse_unread(log: Path) -> None:
    if not log.exists():
        raise UserError(f'no log {log}')
    files = log.iterdir() if log.is_dir() else [log]
    endings = set(map(ending_of, files))
    if endings & BAGS:
        refuse_bag(log)
    if log.is_dir():
        raise UserError(
            f'{log} is a folder without meta/info.json, so no LeRobot data set; name files'
        )
    for why, refused in REFUSED.items():
        if endings & {*refused.split()}:
            raise UserError(f'{log} {why}')


def _foreign(entry: EntryPoint) -> Reader:
    reader: Reader = entry.load()
    file = Path(inspect.getfile(reader.read))
    return replace(reader, read=guarded(file, 'log format', reader.read))


def episodes_of(
    logs: Sequence[Path], mapping: ColumnMap, join: bool
) -> tuple[list[tuple[Path, Table]], str]:
    """Return (log, table) of each episode, and how parts of one run were joined; '' where none."""
    for log in filter(is_lerobot, logs):
        _refuse_open_units(log, mapping)
    read = [(log, read_tables(log, mapping)) for log in logs]
    if not (join or are_parts(logs, [tables[0] for _, tables in read])):
        return [(log, _computed(log, t, mapping)) for log, tables in read for t in tables], ''
    tables, how = joined(read, mapping.time.column)
    return [(logs[0], _computed(logs[0], table, mapping)) for table in tables], how


def _refuse_open_units(log: Path, mapping: ColumnMap) -> None:
    """Refuse angles of a LeRobot data set whose unit the map leaves open, as the data set does."""
    measured, goals = mapping.joints.values(), mapping.inputs.values()
    specs = [spec for columns in measured for spec in (columns.position, columns.velocity)]
    specs += [columns.get('position') for columns in goals]
    for spec in specs:
        if spec and not spec.says_unit:
            raise UserError(
                f'{log}: say the unit of {spec.column}: a LeRobot data set may hold degrees '
                '(unit: deg), radians (unit: rad) or per cent of the calibrated range (scale: '
                'radians for 1 %)'
            )


def _computed(log: Path, table: Table, mapping: ColumnMap) -> Table:
    for name, expression in mapping.columns.items():
        try:
            table = {**table, name: evaluate(expression, table)}
        except UserError as error:
            raise UserError(f'{log}, column {name}: {error}') from None
    return table
