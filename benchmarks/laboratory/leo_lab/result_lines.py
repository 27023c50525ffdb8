# SPDX-License-Identifier: Apache-2.0
"""Files of results: a JSON object per line, one of each case, which is not run again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from leo_msgs_py.errors import one_line, UserError

Row = dict[str, Any]


def read_results(path: Path) -> list[Row]:
    """The lines of a results file; none where there is no file.

    A line that was cut short is left out: its case is run again.

    Raises:
        UserError: it is no results file.
    """
    if not path.exists():
        return []
    try:
        lines = path.read_text().splitlines()
    except (OSError, ValueError) as error:
        raise UserError(f'{path} cannot be read ({one_line(error)}); give another') from error
    rows = [row for line in lines if (row := _row(line)) is not None]
    if lines and not rows:
        raise UserError(f'{path} is no results file: no line of it is a case; give another')
    return rows


def _row(line: str) -> Row | None:
    """What a line says; None where it is no case, or part of one."""
    try:
        row = json.loads(line)
    except ValueError:
        return None
    return row if isinstance(row, dict) else None


def append_result(path: Path, row: Row) -> None:
    """Add a line, behind the end of one that was cut short."""
    path.parent.mkdir(parents=True, exist_ok=True)
    cut = path.exists() and path.read_bytes()[-1:] not in (b'', b'\n')
    with path.open('a') as file:
        file.write('\n' * cut + json.dumps(row) + '\n')
