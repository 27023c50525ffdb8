# SPDX-License-Identifier: Apache-2.0
"""What a JSON or MATLAB log holds as tables: arrays, matrices, lists of rows and single numbers.

Places in it are written `run.data[0]`, `Y[*][1]`, `data[:, 2]`.
"""

from collections.abc import Mapping, Sequence
from itertools import chain
import math
from pathlib import Path
import re
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError

from .log_format import Column, each_once, LogFormat, numbered, Table

WIDEST = 1000  # a matrix of more columns than a robot has sensors is something else
_STEP = re.compile(r'[^.\[\]]+|\[\d+\]|\[\*\]|\[\s*:\s*,\s*\d+\s*\]|\[\s*\d+\s*,\s*:\s*\]')


def steps(place: str) -> list[str]:
    return _STEP.findall(place)


def follow(content: Any, place: str, log: Path) -> Any:
    """Return what is at a place without `[*]`; an error says what there is instead."""
    value = content
    for step in steps(place):
        try:
            value = into(value, step)
        except (KeyError, IndexError, TypeError, ValueError, OverflowError):
            there = ', '.join(map(str, value)) if isinstance(value, dict) else 'no such part'
            raise UserError(f'{log}: nothing at {place!r}; there is {there}') from None
    return value


def into(value: Any, step: str) -> Any:
    """Return what one step leads to; raises what indexing raises."""
    if not step.startswith('['):
        return value[step]
    if ',' not in step:
        return value[int(step[1:-1])]
    first, second = (part.strip() for part in step[1:-1].split(','))
    matrix = np.asarray(value, dtype=float)
    return matrix[:, int(second)] if first == ':' else matrix[int(first), :]


def expand(content: Any, place: str, log: Path) -> list[Any]:
    """Return what a place with at most one `[*]` leads to, one item per episode."""
    before, star, after = place.partition('[*]')
    value = follow(content, before, log)
    if star and not isinstance(value, list | np.ndarray):
        raise UserError(f'{log}: nothing to go through at {place!r}, which needs a list there')
    return [follow(item, after, log) for item in value] if star else [value]


def is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number)


def number(value: Any) -> float:
    """Return a number of a record, NaN for what is missing, null or none."""
    try:
        return float(value) if is_number(value) else math.nan
    except OverflowError:
        return math.nan


def filled(numbers: Mapping[str, float], count: int) -> Table:
    return {name: np.full(count, value, dtype=float) for name, value in numbers.items()}


def column(log: Path, name: str, value: Any) -> Column:
    try:
        return np.asarray(value, dtype=float).ravel()
    except (TypeError, ValueError, OverflowError):
        raise UserError(f'{log}: {name} is not an array of numbers') from None


def columns(log: Path, content: Mapping[str, Any], log_format: LogFormat) -> Table:
    """Return the arrays of a log as columns: a matrix `data` gives `data[:, 0]`, `data[:, 1]`, ...

    Numbers next to them are columns of one value; texts and lists of texts are left out.
    """
    found: Table = {}
    for name, value in content.items():
        if isinstance(value, list | np.ndarray) and _has_numbers(value):
            found |= _split(name, column(log, name, value), np.shape(value))
    if log_format.header and len(found) == len(log_format.header):
        each_once(log_format.header, str(log))
        found = dict(zip(log_format.header, found.values(), strict=True))
    numbers = {name: number(value) for name, value in content.items() if is_number(value)}
    longest = max(map(len, found.values()), default=0)
    return (filled(numbers, longest) | found) if found else {}


def _has_numbers(values: Any) -> bool:
    if isinstance(values, np.ndarray) and values.dtype != object:
        return values.dtype.kind in 'biuf'
    inside = values if isinstance(values, list | np.ndarray) else []
    return is_number(values) or any(map(_has_numbers, inside))


def _split(name: str, flat: Column, shape: tuple[int, ...]) -> Table:
    """Return the columns of an array, along its longer side; of a vector it is itself."""
    wide = [size for size in shape if size > 1]
    if len(wide) < 2:
        return {name: flat}
    if len(wide) > 2 or min(wide) > WIDEST:
        return {}
    matrix = flat.reshape(wide)
    if wide[0] >= wide[1]:
        return {f'{name}[:, {k}]': matrix[:, k] for k in range(wide[1])}
    return {f'{name}[{k}, :]': matrix[k] for k in range(wide[0])}


def from_rows(log: Path, rows: Any, place: str, log_format: LogFormat) -> Table:
    """Return records, or rows that are lists of one length; without a header they are counted."""
    where = place or 'the top'
    kinds = {type(row) for row in rows} if isinstance(rows, list) else set()
    if kinds == {dict}:
        names = [name for name, v in rows[0].items() if not isinstance(v, list | dict)]
        return {name: np.array([number(row.get(name)) for row in rows]) for name in names}
    if kinds != {list}:
        raise UserError(f'{log}: no list of records at {where!r}')
    names = log_format.header or numbered(len(rows[0]))
    each_once(names, str(log))
    for k, row in enumerate(rows, start=1):
        if len(row) != len(names):
            raise UserError(f'{log}: row {k} at {where!r} has {len(row)} values, not {len(names)}')
    return {name: np.array([number(row[k]) for row in rows]) for k, name in enumerate(names)}


def from_fields(log: Path, content: Any, log_format: LogFormat) -> list[Table]:
    """Return one table per match of `[*]`, with the columns that `fields` names."""
    found = {
        name: list(chain.from_iterable(expand(content, place, log) for place in listed(places)))
        for name, places in log_format.fields.items()
    }
    counts = {name: len(v) for name, v in found.items() if len(v) != 1 or not is_number(v[0])}
    if len(set(counts.values())) != 1:
        raise UserError(f'{log}: fields differ in their number of episodes: {counts}')
    episodes = range(next(iter(counts.values())))
    parts = ({n: v[k] if n in counts else v[0] for n, v in found.items()} for k in episodes)
    return [_episode(log, part) for part in parts]


def listed(places: str | Sequence[str]) -> Sequence[str]:
    return [places] if isinstance(places, str) else places


def _episode(log: Path, content: Mapping[str, Any]) -> Table:
    """Return the columns of one episode; a single number is the same in all rows."""
    numbers = {name: number(value) for name, value in content.items() if is_number(value)}
    table = {name: column(log, name, v) for name, v in content.items() if name not in numbers}
    if not table:
        raise UserError(f'{log}: fields lead to single numbers, not to columns')
    same_length(log, table)
    return filled(numbers, len(next(iter(table.values())))) | table


def same_length(log: Path, table: Table) -> Table:
    lengths = {name: len(values) for name, values in table.items()}
    if len(set(lengths.values())) > 1:
        raise UserError(f'{log}: columns differ in length: {lengths}')
    return table
