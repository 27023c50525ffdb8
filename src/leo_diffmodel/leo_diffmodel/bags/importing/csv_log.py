# SPDX-License-Identifier: Apache-2.0
"""CSV logs as a table: whatever parts the columns, with points or commas in the numbers."""

from __future__ import annotations

from collections.abc import Sequence
import csv
from pathlib import Path

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import shown

from .csv_style import (
    constants,
    decimal_of,
    delimiter_of,
    is_numbers,
    spaced,
    units_in,
    without_comments,
)
from .log_format import Column, each_once, LogFormat, numbered, Reader, Table
from .log_text import encoding_of, read_log_text, WINDOWS

_WORDS = {'true': 1.0, 'false': 0.0, '': float('nan')}
_COMMA_FOR_POINT = str.maketrans(',.', '.,')
Row = tuple[int, list[str]]
"""Number of a line, and its cells."""


def read_csv(log: Path, log_format: LogFormat) -> list[Table]:
    """Return the one table of a CSV log; constants of its comments are columns of one value.

    Raises:
        UserError: empty, lines that differ in length, what is no number, a name that two columns
            have, or a delimiter or decimal sign that may be one as well as the other.
    """
    lines = read_log_text(log, log_format.encoding).splitlines()
    header, rows = _headed(_rows(log, lines, log_format), log_format)
    if not rows:
        raise UserError(f'{log} is empty')
    each_once(header, str(log))
    numbers = _numbers(log, rows, header, log_format)
    if numbers.shape[1] != len(header):
        raise UserError(f'{log} has {numbers.shape[1]} columns, its header {len(header)}')
    fixed = {name: np.full(len(rows), value) for name, (value, _) in constants(lines).items()}
    return [fixed | dict(zip(header, numbers.T, strict=True))]


def _headed(rows: Sequence[Row], log_format: LogFormat) -> tuple[list[str], Sequence[Row]]:
    """Return the names of the columns and the rows of numbers; without names they are counted."""
    if not rows:
        return [], rows
    cells = [cell.strip() for cell in rows[0][1]]
    if log_format.header is not None:
        named = any(map(str.isalpha, ''.join(cells))) and not any(map(is_numbers, cells))
        return log_format.header, rows[1:] if named else rows
    if is_numbers(' '.join(cells)) and cells != numbered(len(cells)):
        return numbered(len(cells)), rows
    units = units_in(rows[1][1]) if len(rows) > 1 else []
    if units and len(units) == len(cells):
        names = (f'{n} [{u}]' if u else n for n, u in zip(cells, units, strict=True))
        return [name.strip() for name in names], rows[2:]
    return cells, rows[1:]


def _rows(log: Path, lines: Sequence[str], log_format: LogFormat) -> list[Row]:
    lines = without_comments(lines, log_format.delimiter)
    delimiter = log_format.delimiter
    if delimiter is None and spaced(lines):
        lines, delimiter = [','.join(line.split()) for line in lines], ','
    delimiter = delimiter or delimiter_of(lines, log_format.header, str(log))
    reader = csv.reader(lines, delimiter=delimiter)
    try:
        return [(reader.line_num, row) for row in reader if any(map(str.strip, row)) or row[1:]]
    except csv.Error as error:
        raise UserError(f'{log} line {reader.line_num}: {error}') from None


def _numbers(
    log: Path, rows: Sequence[Row], header: Sequence[str], log_format: LogFormat
) -> Column:
    if log_format.decimal != ',':
        try:
            return np.array([cells for _, cells in rows], dtype=float)
        except ValueError:
            pass
    decimal = log_format.decimal or decimal_of((c for _, cells in rows for c in cells), str(log))
    return np.array([_careful(log, *row, header, decimal) for row in rows])


def _careful(
    log: Path, line: int, row: Sequence[str], header: Sequence[str], decimal: str
) -> list[float]:
    """Convert a row with empty cells or true and false; say where a cell is no number."""
    if len(row) != len(header):
        raise UserError(f'{log} line {line}: {len(row)} values, {len(header)} columns')
    return [
        _number(cell, f'{log} line {line}, {name}', decimal)
        for cell, name in zip(row, header, strict=True)
    ]


def _number(cell: str, where: str, decimal: str) -> float:
    text = cell.strip().lower()
    try:
        if text in _WORDS:
            return _WORDS[text]
        return float(text if decimal == '.' else text.translate(_COMMA_FOR_POINT))
    except ValueError:
        raise UserError(f'{where}: {shown(cell.strip())} is not a number') from None


def _notes(log: Path) -> list[str]:
    """Return what is to be known of an encoding that was guessed, and constants of comments."""
    code = encoding_of(log)
    notes = [f'read as {code}: it is no UTF-8'] if code == WINDOWS else []
    found = constants(read_log_text(log).splitlines())
    if found:
        listed = ', '.join(
            f'{shown(name)[1:-1]} = {value:.6g} {unit}'.rstrip()
            for name, (value, unit) in found.items()
        )
        notes.append(
            f'its comments say {listed}: columns of one value; where the robot has it: '
            'constants: {links.LINK.mass: {column: mass, unit: kg}}'
        )
    return notes


CSV = Reader('csv', ('csv', 'txt'), read_csv, notes=_notes)
