# SPDX-License-Identifier: Apache-2.0
"""Tables of logs as a column map wants them: parts of one run joined, columns computed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from leo_msgs_py.errors import UserError

from .column_map import ColumnMap
from .expression import evaluate, Table
from .join import are_parts, joined
from .lerobot import is_lerobot
from .tables import read_tables


def episodes_of(
    logs: Sequence[Path], mapping: ColumnMap, join: bool
) -> tuple[list[tuple[Path, Table]], str]:
    """Return (log, table) of each episode, and how parts of one run were joined; '' where none."""
    read = [(log, _read(log, mapping)) for log in logs]
    if not (join or are_parts(logs, [tables[0] for _, tables in read])):
        return [(log, _computed(log, t, mapping)) for log, tables in read for t in tables], ''
    both = joined(read, mapping.time.column)
    return [(logs[0], _computed(logs[0], table, mapping)) for table in both.tables], both.told


def tables_of(log: Path, mapping: ColumnMap) -> list[Table]:
    """Return the tables of a log with the computed columns."""
    return [_computed(log, table, mapping) for table in _read(log, mapping)]


def _read(log: Path, mapping: ColumnMap) -> list[Table]:
    if is_lerobot(log):
        _say_their_unit(log, mapping)
    return read_tables(log, mapping)


def _say_their_unit(log: Path, mapping: ColumnMap) -> None:
    """Refuse angles of a LeRobot data set whose unit the map leaves open, as the data set does."""
    specs = [
        spec
        for columns in mapping.joints.values()
        for spec in (columns.position, columns.velocity)
    ]
    specs += [columns.get('position') for columns in mapping.inputs.values()]
    for spec in specs:
        if spec and not spec.says_unit:
            raise UserError(
                f'{log}: say the unit of {spec.column}: a LeRobot data set may hold degrees '
                '(unit: deg), radians (unit: rad) or per cent of the calibrated range (scale: '
                'radians for 1 %)'
            )


def _computed(log: Path, table: Table, mapping: ColumnMap) -> Table:
    """Return a table with the computed columns added."""
    for name, expression in mapping.columns.items():
        try:
            table = {**table, name: evaluate(expression, table)}
        except UserError as error:
            raise UserError(f'{log}, column {name}: {error}') from None
    return table
