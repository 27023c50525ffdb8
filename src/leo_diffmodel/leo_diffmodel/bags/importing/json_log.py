# SPDX-License-Identifier: Apache-2.0
"""JSON logs as tables: lists of records, rows that are lists, or one array for each column."""

from collections import Counter
from functools import partial
import json
from pathlib import Path
from typing import Any

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import shown

from . import arrays_log as arrays
from .log_format import LogFormat, read_log_text, Reader, Table

DEEPEST = 5


def read_json(log: Path, log_format: LogFormat) -> list[Table]:
    content = _content(log, log_format)
    if log_format.fields:
        return arrays.from_fields(log, content, log_format)
    return [_table(log, content, p, log_format) for p in arrays.listed(log_format.records or '')]


def _content(log: Path, log_format: LogFormat) -> Any:
    try:
        text = read_log_text(log, log_format.encoding)
        return json.loads(text, object_pairs_hook=partial(_each_once, log))
    except RecursionError:
        raise UserError(f'{log} is nested too deeply for a log') from None
    except ValueError as error:
        raise UserError(f'{log} is not JSON: {error}') from None


def _each_once(log: Path, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        times = Counter(name for name, _ in pairs)
        twice = next(name for name in times if times[name] > 1)
        raise UserError(f'{log}: {shown(twice)} stands twice in one object; rename one')
    return found


def _table(log: Path, content: Any, place: str, log_format: LogFormat) -> Table:
    rows = arrays.follow(content, place, log)
    if isinstance(rows, dict):
        return arrays.same_length(log, arrays.columns(log, rows, log_format))
    table = arrays.from_rows(log, rows, place, log_format)
    return arrays.filled(_on_the_way(content, place), len(rows)) | table


def _on_the_way(content: Any, place: str) -> dict[str, float]:
    """Return the numbers that a log has at each level on the way to its records."""
    found: dict[str, float] = {}
    for step in arrays.steps(place):
        if isinstance(content, dict):
            found |= {name: arrays.number(v) for name, v in content.items() if arrays.is_number(v)}
        content = arrays.into(content, step)
    return found


def places_of_rows(content: Any, place: str = '', deep: int = 0) -> str | list[str] | None:
    """Return where the first list of rows, or of columns, is; None where there is none.

    Rows that are lists, under several names side by side, are episodes: all their places.
    """
    if isinstance(content, list):
        records = bool(content) and all(isinstance(row, dict) for row in content)
        return place if records or _are_rows(content) else None
    if not isinstance(content, dict) or deep > DEEPEST:
        return None
    if any(isinstance(v, list) and v and arrays.is_number(v[0]) for v in content.values()):
        return place
    inside = {key: f'{place}.{key}'.lstrip('.') for key in content}
    episodes = [inside[key] for key, value in content.items() if _are_rows(value)]
    if len(episodes) > 1:
        return episodes
    found = (places_of_rows(v, inside[key], deep + 1) for key, v in content.items())
    return next((each for each in found if each is not None), None)


def _are_rows(value: Any) -> bool:
    if not isinstance(value, list) or len(value) < 2:
        return False
    rows = all(isinstance(row, list) and row and arrays.is_number(row[0]) for row in value)
    return rows and len(set(map(len, value))) == 1


def _guessed(log: Path) -> LogFormat:
    return LogFormat(records=places_of_rows(_content(log, LogFormat())))


JSON = Reader('json', ('json',), read_json, guessed=_guessed)
