# SPDX-License-Identifier: Apache-2.0
"""Logs as tables: CSV rows, JSON records, MATLAB arrays; several episodes where a log has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import csv
from itertools import chain
import json
from pathlib import Path
import re
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError

from .column_map import ColumnMap
from .expression import Column

Table = dict[str, Column]
"""Columns by name, all of one length."""

_WORDS = {'true': 1.0, 'false': 0.0, '': float('nan')}
_PATH = re.compile(r'[^.\[\]]+|\[\d+\]|\[\*\]')


def read_tables(log: Path, column_map: ColumnMap) -> list[Table]:
    """Return the tables of a log, one per episode, each with at least one column.

    Raises:
        UserError: no such file, an unknown format, or not a log as the map says.
    """
    if not log.is_file():
        raise UserError(f'no log {log}')
    name = column_map.format or log.suffix.lower().lstrip('.')
    readers: dict[str, Callable[[Path, ColumnMap], list[Table]]] = {
        'csv': _read_csv, 'txt': _read_csv, 'json': _read_json, 'mat': _read_mat,
    }
    if name not in readers:
        raise UserError(f'{log}: unknown format {name!r}; name one (format: csv, json or mat)')
    return readers[name](log, column_map)


def _read_csv(log: Path, column_map: ColumnMap) -> list[Table]:
    try:
        lines = log.read_text(encoding='utf-8-sig').splitlines()
    except UnicodeDecodeError:
        raise UserError(f'{log} is not text; is it a CSV file?') from None
    rows = list(csv.reader(lines, delimiter=column_map.delimiter))
    header = column_map.header
    first = 0 if header else 1
    if header is None:
        header = [cell.strip().lstrip('#').strip() for cell in rows[0]] if rows else []
    if len(rows) <= first:
        raise UserError(f'{log} is empty')
    try:
        numbers = np.array(rows[first:], dtype=float)
    except ValueError:
        numbers = np.array(_careful(log, rows[first:], first + 1, header))
    if numbers.shape[1] != len(header):
        raise UserError(f'{log} has {numbers.shape[1]} columns, its header {len(header)}')
    return [dict(zip(header, numbers.T, strict=True))]


def _careful(
    log: Path, rows: Sequence[Sequence[str]], line: int, header: Sequence[str],
) -> list[list[float]]:
    """Convert rows with empty cells or true and false; say where a cell is no number."""
    table = []
    for number, row in enumerate(rows, start=line):
        if row and len(row) != len(header):
            raise UserError(f'{log} line {number}: {len(row)} values, {len(header)} columns')
        values = [
            _number(cell, f'{log} line {number}, {name}')
            for cell, name in zip(row, header, strict=False)
        ]
        if values:
            table.append(values)
    return table


def _number(cell: Any, where: str) -> float:
    text = str(cell).strip()
    try:
        return _WORDS[text.lower()] if text.lower() in _WORDS else float(text)
    except ValueError:
        raise UserError(f'{where}: {text!r} is not a number') from None


def _read_json(log: Path, column_map: ColumnMap) -> list[Table]:
    try:
        content = json.loads(log.read_text(encoding='utf-8'))
    except (ValueError, UnicodeDecodeError) as error:
        raise UserError(f'{log} is not JSON: {error}') from None
    if column_map.fields:
        return _fields(log, content, column_map)
    records = _follow(content, column_map.records or '', log)
    if isinstance(records, dict):
        return [_same_length(log, {key: _array(log, key, v) for key, v in records.items()})]
    if not isinstance(records, list) or not records or not isinstance(records[0], dict):
        raise UserError(f'{log}: no list of records at {column_map.records or "the top"!r}')
    names = [name for name, value in records[0].items() if not isinstance(value, list | dict)]
    return [{name: _record_column(log, records, name) for name in names}]


def _record_column(log: Path, records: Sequence[Mapping[str, Any]], name: str) -> Column:
    """Return one key of all records, NaN where it is missing, null or no number."""
    values = [record.get(name) for record in records]
    if any(isinstance(value, str) for value in values):
        return np.full(len(values), np.nan)
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def _read_mat(log: Path, column_map: ColumnMap) -> list[Table]:
    import scipy.io
    from scipy.io.matlab import MatReadError

    try:
        content = scipy.io.loadmat(log, squeeze_me=False, simplify_cells=True)
    except NotImplementedError:
        raise UserError(f'{log} is a MATLAB 7.3 file; save it with -v7') from None
    except (MatReadError, ValueError, TypeError, OSError) as error:
        raise UserError(f'{log} is not a MATLAB file: {error}') from None
    content = {name: value for name, value in content.items() if not name.startswith('__')}
    if column_map.fields:
        return _fields(log, content, column_map)
    arrays = {name: _array(log, name, value) for name, value in content.items()}
    longest = max((len(array) for array in arrays.values()), default=0)
    return [{name: array for name, array in arrays.items() if len(array) == longest}]


def _fields(log: Path, content: Any, column_map: ColumnMap) -> list[Table]:
    """Return one table per match of `[*]`, with the columns that `fields` names."""
    found = {
        name: list(chain.from_iterable(
            _expand(content, path, log) for path in ([paths] if isinstance(paths, str) else paths)
        ))
        for name, paths in column_map.fields.items()
    }
    counts = {name: len(values) for name, values in found.items()}
    if len(set(counts.values())) != 1:
        raise UserError(f'{log}: fields differ in their number of episodes: {counts}')
    episodes = range(next(iter(counts.values())))
    return [
        _same_length(log, {name: _array(log, name, values[k]) for name, values in found.items()})
        for k in episodes
    ]


def _expand(content: Any, path: str, log: Path) -> list[Any]:
    """Return what a path with at most one `[*]` leads to, one item per episode."""
    before, star, after = path.partition('[*]')
    value = _follow(content, before, log)
    return [_follow(item, after, log) for item in value] if star else [value]


def _follow(content: Any, path: str, log: Path) -> Any:
    """Return what a path as `run.data[0]` leads to."""
    value = content
    for part in _PATH.findall(path):
        try:
            value = value[int(part[1:-1])] if part.startswith('[') else value[part]
        except (KeyError, IndexError, TypeError, ValueError):
            there = ', '.join(map(str, value)) if isinstance(value, dict) else 'no such part'
            raise UserError(f'{log}: nothing at {path!r}; there is {there}') from None
    return value


def _array(log: Path, name: str, value: Any) -> Column:
    try:
        return np.asarray(value, dtype=float).ravel()
    except (TypeError, ValueError):
        raise UserError(f'{log}: {name} is not an array of numbers') from None


def _same_length(log: Path, table: Table) -> Table:
    lengths = {name: len(column) for name, column in table.items()}
    if len(set(lengths.values())) != 1:
        raise UserError(f'{log}: columns differ in length: {lengths}')
    return table
