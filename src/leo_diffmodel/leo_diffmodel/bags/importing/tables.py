# SPDX-License-Identifier: Apache-2.0
"""Logs as tables: CSV rows, JSON records, MATLAB arrays, LeRobot frames; one for each episode."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
import json
import math
from pathlib import Path
import re
from typing import Any

import numpy as np

from leo_msgs_py.errors import one_line, UserError
from leo_sim.common.yaml_file import read_text

from .csv_log import read_csv
from .expression import Column, Table
from .lerobot import is_lerobot, read_lerobot
from .log_format import LogFormat

_PATH = re.compile(r'[^.\[\]]+|\[\d+\]|\[\*\]')


def read_tables(log: Path, log_format: LogFormat) -> list[Table]:
    """Return the tables of a log, one per episode, each with at least one column.

    Raises:
        UserError: no such file, an unknown format, or not a log as the map says.
    """
    readers: dict[str, Callable[[Path, LogFormat], list[Table]]] = {
        'csv': read_csv, 'txt': read_csv, 'json': _read_json, 'mat': _read_mat,
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


def _read_json(log: Path, log_format: LogFormat) -> list[Table]:
    try:
        content = json.loads(read_text(log).removeprefix('\ufeff'))
    except RecursionError:
        raise UserError(f'{log} is nested too deeply for a log') from None
    except ValueError as error:
        raise UserError(f'{log} is not JSON: {error}') from None
    if log_format.fields:
        return _fields(log, content, log_format)
    records, beside = _follow(content, log_format.records or '', log), _beside(content, log_format)
    if isinstance(records, dict):
        return [_same_length(log, {key: _array(log, key, v) for key, v in records.items()})]
    if not isinstance(records, list) or not records or not _are_mappings(records):
        raise UserError(f'{log}: no list of records at {log_format.records or "the top"!r}')
    names = [name for name, value in records[0].items() if not isinstance(value, list | dict)]
    rows = {name: np.array([_value(record.get(name)) for record in records]) for name in names}
    return [_filled(beside, len(records)) | rows]


def _beside(content: Any, log_format: LogFormat) -> dict[str, float]:
    """Return the numbers that a log has beside its records, at each level on the way there."""
    found: dict[str, float] = {}
    for part in _PATH.findall(log_format.records or ''):
        if isinstance(content, dict):
            found |= {name: _value(v) for name, v in content.items() if _is_number(v)}
        content = content[int(part[1:-1]) if part.startswith('[') else part]
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number)


def _filled(numbers: dict[str, float], count: int) -> Table:
    """Return numbers as columns, the same in every row."""
    return {name: np.full(count, value, dtype=float) for name, value in numbers.items()}


def _are_mappings(records: Sequence[Any]) -> bool:
    return all(isinstance(record, dict) for record in records)


def _value(value: Any) -> float:
    """Return a number of a record, NaN for what is missing, null or none."""
    try:
        return float(value) if _is_number(value) else math.nan
    except OverflowError:
        return math.nan


def _read_mat(log: Path, log_format: LogFormat) -> list[Table]:
    import scipy.io

    try:
        content = scipy.io.loadmat(log, squeeze_me=False, simplify_cells=True)
    except NotImplementedError:
        raise UserError(f'{log} is a MATLAB 7.3 file; save it with -v7') from None
    except Exception as error:  # of a damaged file anything
        raise UserError(f'{log} is not a MATLAB file: {one_line(error)}') from error
    content = {name: value for name, value in content.items() if not name.startswith('__')}
    if log_format.fields:
        return _fields(log, content, log_format)
    arrays = {name: _array(log, name, value) for name, value in content.items()}
    longest = max((len(array) for array in arrays.values()), default=0)
    return [{name: array for name, array in arrays.items() if len(array) == longest}]


def _fields(log: Path, content: Any, log_format: LogFormat) -> list[Table]:
    """Return one table per match of `[*]`, with the columns that `fields` names."""
    found = {
        name: list(chain.from_iterable(
            _expand(content, path, log) for path in ([paths] if isinstance(paths, str) else paths)
        ))
        for name, paths in log_format.fields.items()
    }
    counts = {name: len(v) for name, v in found.items() if len(v) != 1 or not _is_number(v[0])}
    if len(set(counts.values())) != 1:
        raise UserError(f'{log}: fields differ in their number of episodes: {counts}')
    episodes = range(next(iter(counts.values())))
    return [_episode(log, {n: v[k] if n in counts else v[0] for n, v in found.items()})
            for k in episodes]


def _episode(log: Path, content: dict[str, Any]) -> Table:
    """Return the columns of one episode; a single number is the same in all rows."""
    numbers = {name: _value(value) for name, value in content.items() if _is_number(value)}
    arrays = {n: _array(log, n, v) for n, v in content.items() if n not in numbers}
    if not arrays:
        raise UserError(f'{log}: fields lead to single numbers, not to columns')
    table = _same_length(log, arrays)
    return _filled(numbers, len(next(iter(table.values())))) | table


def _expand(content: Any, path: str, log: Path) -> list[Any]:
    """Return what a path with at most one `[*]` leads to, one item per episode."""
    before, star, after = path.partition('[*]')
    value = _follow(content, before, log)
    if star and not isinstance(value, list | np.ndarray):
        raise UserError(f'{log}: nothing to go through at {path!r}, which needs a list there')
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
    except (TypeError, ValueError, OverflowError):
        raise UserError(f'{log}: {name} is not an array of numbers') from None


def _same_length(log: Path, table: Table) -> Table:
    lengths = {name: len(column) for name, column in table.items()}
    if len(set(lengths.values())) != 1:
        raise UserError(f'{log}: columns differ in length: {lengths}')
    return table
