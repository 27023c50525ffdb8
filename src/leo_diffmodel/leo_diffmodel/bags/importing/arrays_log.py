# SPDX-License-Identifier: Apache-2.0
"""What a log of nested names holds as tables: arrays, matrices, lists of rows and single numbers.

Places in it are written `run.data[0]`, `Y[*][1]`, `data[:, 2]`. A column `arm.q[1]` has the second
number of each sample of `q` in `arm`.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from itertools import chain
import math
from pathlib import Path
import re
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import shown

from .log_format import Column, each_once, LogFormat, number_of, numbered, Reader, Table

MOST_NAMED, LONG = 40, 99  # names in a line, letters of one
WIDEST = 128  # a matrix of more columns than a robot has sensors is something else
TO_DO = 'cut them to one length, or save each rate with its time as a file and say --join'
_EPISODE = re.compile(
    r'(?:.*\.)?(?:demo|episode|ep|run|rollout|trajectory|traj|trial)_?(\d+)\.(.+)'
)
_STAMPS = {'nanosec': 'sec', 'nsec': 'sec', 'nsecs': 'secs', 'nanos': 'seconds'}
_STEP = re.compile(r'[^.\[\]]+|\[\d+\]|\[\*\]|\[\s*:\s*,\s*\d+\s*\]|\[\s*\d+\s*,\s*:\s*\]')


def steps(place: str) -> list[str]:
    return _STEP.findall(place)


def follow(content: Any, place: str, log: Path) -> Any:
    value = content
    for step in steps(place):
        try:
            value = into(value, step)
        except (KeyError, IndexError, TypeError, ValueError, OverflowError):
            there = ', '.join(map(str, value)) if isinstance(value, dict) else 'no such part'
            raise UserError(f'{log}: nothing at {place!r}; there is {there}') from None
    return value


def into(value: Any, step: str) -> Any:
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
    try:
        return float(value) if is_number(value) else math.nan
    except OverflowError:
        return math.nan


def filled(numbers: Mapping[str, float], count: int) -> Table:
    return {name: np.full(count, value, dtype=float) for name, value in numbers.items()}


def tree(
    group: Any, names: Callable[[Any], Iterable[str]], above: Sequence[Any] = ()
) -> dict[str, Any]:
    """Return groups as dicts, each but once inside itself, and arrays that may be columns."""
    found: dict[str, Any] = {}
    for name in names(group):
        with suppress(KeyError, TypeError, ValueError):
            node = group[name]
            if not hasattr(node, 'shape'):
                inside = (*above, group)
                found |= {} if node in inside else {name: tree(node, names, inside)}
            elif are_columns(node.shape or ()):
                found[name] = node[()]
    return found


def are_columns(shape: Sequence[int]) -> bool:
    wide = sorted(size for size in shape if size > 1)
    return len(wide) < 2 or (len(wide) == 2 and wide[0] <= WIDEST)


def flat(content: Mapping[str, Any], before: str = '') -> Iterator[tuple[str, Any]]:
    """Yield what nested names lead to, as `arm.q`; parts of a structured array are names, too."""
    for name, value in content.items():
        if isinstance(value, np.ndarray) and value.dtype.names:
            value = {part: value[part] for part in value.dtype.names}
        if isinstance(value, dict):
            yield from flat(value, f'{before}{name}.')
        else:
            yield f'{before}{name}', value


def tables(log: Path, content: Any, log_format: LogFormat) -> list[Table]:
    """Return one table per episode: what the map says, else each of groups like demo_0, demo_1."""
    if log_format.fields:
        return from_fields(log, content, log_format)
    if log_format.records is None and isinstance(content, dict):
        return [columns(log, part, log_format) for part in episodes(content)]
    return [_table(log, content, place, log_format) for place in listed(log_format.records or '')]


def reader(name: str, endings: Sequence[str], content: Callable[[Path], Any]) -> Reader:
    return Reader(
        name,
        tuple(endings),
        lambda log, log_format: tables(log, content(log), log_format),
        notes=lambda log: left_out(content(log)),
    )


def episodes(content: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return what each of several numbered groups holds, with the numbers beside; else all."""
    found: dict[int, dict[str, Any]] = defaultdict(dict)
    for name, value in flat(content):
        if match := _EPISODE.fullmatch(name):
            found[int(match[1])][match[2]] = value
    beside = {name: value for name, value in flat(content) if is_number(value)}
    return [beside | found[k] for k in sorted(found)] or [content]


def _table(log: Path, content: Any, place: str, log_format: LogFormat) -> Table:
    rows = follow(content, place, log)
    if isinstance(rows, dict):
        return columns(log, rows, log_format)
    table = from_rows(log, rows, place, log_format)
    return filled(_on_the_way(content, place), len(rows)) | table


def _on_the_way(content: Any, place: str) -> dict[str, float]:
    found: dict[str, float] = {}
    for step in steps(place):
        if isinstance(content, dict):
            found |= {name: number(value) for name, value in content.items() if is_number(value)}
        content = into(content, step)
    return found


def columns(log: Path, content: Mapping[str, Any], log_format: LogFormat) -> Table:
    """Return the arrays of a log that are as long as those that the map names, else the longest.

    Numbers next to them are columns of one value; texts, pictures and ragged lists are left out.
    """
    arrays, of_map = _arrays(content, log_format.order), log_format.named()
    counts = {len(values): name for name, values in arrays.items() if name in of_map}
    if len(counts) > 1:
        (one, first), (other, second) = list(counts.items())[:2]
        raise UserError(f'{log}: {first} has {one} values and {second} {other}; {TO_DO}')
    length = next(iter(counts), max(map(len, arrays.values()), default=0))
    found = {name: values for name, values in arrays.items() if len(values) == length}
    if log_format.header and len(found) == len(log_format.header):
        each_once(log_format.header, str(log))
        found = dict(zip(log_format.header, found.values(), strict=True))
    numbers = {name: number(value) for name, value in flat(content) if is_number(value)}
    return (filled(numbers, length) | found) if found else {}


def left_out(content: Any) -> list[str]:
    """Say which arrays of a log are shorter than the others, in a line at most."""
    first = episodes(content)[0] if isinstance(content, dict) else {}
    counts = {name: len(values) for name, values in _arrays(first, ()).items()}
    longest = max(counts.values(), default=0)
    shorter = {name: count for name, count in counts.items() if count < longest}
    have = ' or '.join(map(str, sorted({*shorter.values()})))
    why = f'{have} values and not {longest}, so left out; {TO_DO}'
    return [f'{named(shorter)}: {why}'] if shorter else []


def named(names: Iterable[str]) -> str:
    listed = [repr(name) if len(name) < LONG else shown(name) for name in names]
    more = len(listed) - MOST_NAMED
    return ', '.join(listed[:MOST_NAMED]) + (f' and {more} more' if more > 0 else '')


def _arrays(content: Mapping[str, Any], order: Sequence[str]) -> Table:
    found: Table = {}
    for name, value in flat(content):
        if _has_numbers(value) and not is_number(value):
            with suppress(TypeError, ValueError, OverflowError):  # of what is ragged
                if are_columns(np.shape(value)):
                    found |= _split(name, _floats(value), order)
    return found


def _floats(values: Any) -> Column:
    """Return numbers, of moments and durations in seconds."""
    array = np.asarray(values)
    if array.dtype.kind not in 'mM':
        return np.asarray(values, dtype=float)
    whole = array.astype(f'{array.dtype.kind}8[ns]')
    return np.where(np.isnat(whole), np.nan, 1e-9 * whole.astype('int64'))


def _has_numbers(values: Any) -> bool:
    if isinstance(values, np.ndarray) and values.dtype != object:
        return values.dtype.kind in 'biufmM'
    inside = values if isinstance(values, list | np.ndarray) else []
    return is_number(values) or any(map(_has_numbers, inside))


def _split(name: str, values: Column, order: Sequence[str]) -> Table:
    """Return the columns of an array, along its longer side; of a vector it is itself."""
    matrix = values.squeeze()
    if matrix.ndim < 2:
        return {name: matrix.ravel()}
    rows = matrix if matrix.shape[0] < matrix.shape[1] else matrix.T
    return dict(zip(_keys(name, rows, order), rows, strict=True))


def _keys(name: str, values: Sequence[Any] | Column, order: Sequence[str]) -> list[str]:
    """Return what parts of a list are called: by their order, by a name each has, or [0], [1]."""
    if len(values) and isinstance(values[0], dict):
        order = [each.get('name', '') for each in values if isinstance(each, dict)]
    return _places(name, len(values), tuple(map(str, order)))


@cache
def _places(name: str, count: int, order: tuple[str, ...]) -> list[str]:
    if len(order) == count and all(order):
        return [f'{name}.{part}' for part in order]
    return [f'{name}[{k}]' for k in range(count)]


def from_rows(log: Path, rows: Any, place: str, log_format: LogFormat) -> Table:
    """Return records, or rows that are lists of one length; without a header they are counted."""
    where = place or 'the top'
    kinds = {type(row) for row in rows} if isinstance(rows, list) else set()
    if kinds == {dict}:
        return stacked([numbers_in(row, log_format.order) for row in rows])
    if kinds != {list}:
        raise UserError(f'{log}: no list of records at {where!r}')
    names = log_format.header or numbered(len(rows[0]))
    each_once(names, str(log))
    for k, row in enumerate(rows, start=1):
        if len(row) != len(names):
            raise UserError(f'{log}: row {k} at {where!r} has {len(row)} values, not {len(names)}')
    return {name: np.array([number(row[k]) for row in rows]) for k, name in enumerate(names)}


def stacked(rows: Sequence[Mapping[str, float]]) -> Table:
    names = dict.fromkeys(chain.from_iterable(rows))
    return {name: np.array([row.get(name, math.nan) for row in rows]) for name in names}


def numbers_in(
    value: Any, order: Sequence[str], name: str = '', found: dict[str, float] | None = None
) -> dict[str, float]:
    """Return the numbers of one record: `q[1]`, or `q.elbow` by its names or the map's order."""
    found = {} if found is None else found
    if isinstance(value, float):
        found[name] = value
    elif isinstance(value, str):
        with suppress(ValueError):
            found[name] = number_of(value)
    elif isinstance(value, dict):
        if rest := next(iter(_STAMPS.keys() & value.keys()), None):
            found[name] = number(value.get(_STAMPS[rest])) + 1e-9 * number(value[rest])
            return found
        names = value.get('name') or value.get('joint_names')
        order = names if isinstance(names, list) else order
        for key, inside in value.items():
            numbers_in(inside, order, f'{name}.{key}' if name else key, found)
    elif not isinstance(value, list | np.ndarray):
        found[name] = number(value)
    elif len(value) <= WIDEST:
        for key, inside in zip(_keys(name, value, order), value, strict=True):
            numbers_in(inside, order, key, found)
    return found


def from_fields(log: Path, content: Any, log_format: LogFormat) -> list[Table]:
    found = {
        name: list(chain.from_iterable(expand(content, place, log) for place in listed(places)))
        for name, places in log_format.fields.items()
    }
    counts = {name: len(v) for name, v in found.items() if len(v) != 1 or not is_number(v[0])}
    if len(set(counts.values())) != 1:
        raise UserError(f'{log}: fields differ in their number of episodes: {counts}')
    episodes = range(next(iter(counts.values())))
    parts = ({n: v[k] if n in counts else v[0] for n, v in found.items()} for k in episodes)
    return [columns(log, part, log_format) for part in parts]


def listed(places: str | Sequence[str]) -> Sequence[str]:
    return [places] if isinstance(places, str) else places
