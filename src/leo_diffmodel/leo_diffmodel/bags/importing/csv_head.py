# SPDX-License-Identifier: Apache-2.0
"""What stands above the rows of a CSV file: comments, constants in them, and the header."""

from __future__ import annotations

from collections.abc import Sequence
import re
from typing import NamedTuple

from .csv_style import DELIMITERS, LOOKED_AT, width
from .unit_names import canonical, is_unit

COMMENT = ('#', '%', '//')
_NUMBER = r'[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?'
_CONSTANT = re.compile(
    rf'([^\W\d][\w.]*(?: [^\W\d][\w.]*)*)\s*[=:]\s*({_NUMBER})(?![\d.,:/-]*\d)\s*([^\s,;=]*)',
    re.IGNORECASE,
)
"""`mass = 0.5 kg`, but no date and no time of day."""
_LETTERS = re.compile(r'[^\W\d_]+')
_IN_NUMBERS = {'e', 'nan', 'inf', 'true', 'false'}


def without_comments(lines: Sequence[str], delimiter: str | None) -> list[str]:
    """Return the lines with comments blanked; a header that is one stays, without its sign.

    Args:
        lines: of the file.
        delimiter: as the column map says it, else those that are tried.
    """
    body = ['' if _is_comment(line) else line for line in lines]
    first = next((k for k, line in enumerate(body) if line.strip()), len(body))
    if first < len(body) and is_numbers(body[first]):
        rows = [line for line in body if line.strip()][:LOOKED_AT]
        for k in reversed(range(first)):
            text = lines[k].strip().lstrip('#%/').strip()
            if text and _is_header(text, rows, delimiter):
                return [*body[:k], text, *body[k + 1 :]]
    return body


class Constant(NamedTuple):
    """A number in a comment, and the unit that is written after it; '' without one."""

    value: float
    unit: str


def constants(lines: Sequence[str]) -> dict[str, Constant]:
    """Return the numbers that comments above the rows give names to, as `# mass = 0.5`."""
    found: dict[str, Constant] = {}
    for line in lines:
        if line.strip() and not _is_comment(line):
            break
        for name, number, unit in _CONSTANT.findall(line.strip().lstrip('#%/')):
            known = canonical(unit) if is_unit(unit) else ''
            found.setdefault(name, Constant(float(number.replace(',', '.')), known))
    return found


def is_numbers(line: str) -> bool:
    """Say whether a line has numbers and no other words."""
    words = set(_LETTERS.findall(line.lower()))
    return any(map(str.isdigit, line)) and words <= _IN_NUMBERS


def are_units(cells: Sequence[str]) -> bool:
    """Say whether a line below the header says the units: one at least, and nothing else."""
    told = [cell.strip('[]() ') for cell in cells]
    named = [unit for unit in told if unit not in ('', '-', '1')]
    return bool(named) and all(is_unit(unit) for unit in named)


def in_brackets(unit: str) -> str:
    """Return a unit as a header has it, [deg]; nothing for none."""
    told = unit.strip('[]() ')
    return f'[{told}]' if told not in ('', '-', '1') else ''


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENT)


def _is_header(text: str, rows: Sequence[str], delimiter: str | None) -> bool:
    """Say whether a comment has a name for each column of the rows, and no number."""
    if is_numbers(text) or _CONSTANT.search(text):
        return False
    signs = (delimiter,) if delimiter else DELIMITERS
    if any(width([text, *rows], sign) > 1 for sign in signs):
        return True
    return len({len(line.split()) for line in (text, *rows)}) == 1
