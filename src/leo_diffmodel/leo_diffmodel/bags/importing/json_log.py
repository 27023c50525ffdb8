# SPDX-License-Identifier: Apache-2.0
"""JSON logs as tables: lists or lines of records, rows that are lists, arrays for columns."""

from collections import Counter, defaultdict
from functools import partial
import json
from pathlib import Path
from typing import Any

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import shown

from . import arrays_log as arrays
from .log_format import LogFormat, read_log_text, Reader, Table


def read_json(log: Path, log_format: LogFormat, lines: bool = False) -> list[Table]:
    return arrays.tables(log, _content(log, log_format, lines), log_format)


def _content(log: Path, log_format: LogFormat, lines: bool = False) -> Any:
    try:
        text = read_log_text(log, log_format.encoding)
        if lines:
            text = '[' + ',\n'.join(filter(str.strip, text.split('\n'))) + ']'
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


def _guessed(log: Path) -> LogFormat:
    content = _content(log, LogFormat())
    found: dict[type, dict[str, int]] = defaultdict(dict)
    for name, value in arrays.flat(content if isinstance(content, dict) else {}):
        if isinstance(value, list) and value:
            found[type(value[0])][name] = len(value)
    if found[dict]:
        return LogFormat(records=max(found[dict], key=found[dict].__getitem__))
    return LogFormat(records=None if found[float] or found[int] else [*found[list]] or None)


def _notes(log: Path) -> list[str]:
    return [] if _guessed(log).records else arrays.left_out(_content(log, LogFormat()))


JSON = Reader('json', ('json',), read_json, guessed=_guessed, notes=_notes)
JSON_LINES = Reader('jsonl', ('jsonl', 'ndjson'), partial(read_json, lines=True))
