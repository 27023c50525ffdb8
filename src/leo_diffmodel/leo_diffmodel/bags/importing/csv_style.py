# SPDX-License-Identifier: Apache-2.0
"""How a CSV file is written: comments with constants and a header, delimiter, decimal sign."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import csv
import re

from leo_msgs_py.errors import UserError

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


def constants(lines: Sequence[str]) -> dict[str, tuple[float, str]]:
    """Return the numbers that comments above the rows give names to, as `# mass = 0.5 kg`.

    With each is its unit, '' without one.
    """
    found: dict[str, tuple[float, str]] = {}
    for line in lines:
        if line.strip() and not _is_comment(line):
            break
        for name, number, unit in _CONSTANT.findall(line.strip().lstrip('#%/')):
            known = canonical(unit) if is_unit(unit) else ''
            found.setdefault(name, (float(number.replace(',', '.')), known))
    return found


def is_numbers(line: str) -> bool:
    """Say whether a line has numbers and no other words."""
    words = set(_LETTERS.findall(line.lower()))
    return any(map(str.isdigit, line)) and words <= _IN_NUMBERS


def units_in(cells: Sequence[str]) -> list[str]:
    """Return the units that a line below the header says, '' for none; [] if it says others."""
    units = [cell.strip().strip('[]() ') for cell in cells]
    units = ['' if unit in ('-', '1') else unit for unit in units]
    return units if any(units) and all(map(is_unit, filter(None, units))) else []


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


DELIMITERS = (',', ';', '\t')
LOOKED_AT = 50
"""So many lines are tried."""
_COMMA = re.compile(r'[+-]?\d*,\d+(e[+-]?\d+)?', re.ASCII | re.IGNORECASE)
_POINT = re.compile(r'[+-]?\d*\.\d+(e[+-]?\d+)?', re.ASCII | re.IGNORECASE)
_THOUSANDS = re.compile(r'[+-]?[1-9]\d{0,2}(,\d{3})+', re.ASCII)


def delimiter_of(lines: Sequence[str], header: Sequence[str] | None, log: str) -> str:
    """Return what parts all lines into as many columns; where nothing does, what the first has.

    Args:
        lines: of the file.
        header: names of the columns, where the file itself does not say them.
        log: opens the error line.

    Raises:
        UserError: one sign does as well as another.
    """
    first = [line for line in lines if line.strip()][:LOOKED_AT]
    counts = {sign: width(first, sign) for sign in DELIMITERS}
    fitting = [sign for sign, count in counts.items() if count > 1]
    named = [sign for sign in fitting if header is not None and counts[sign] == len(header)]
    if len(named or fitting) > 1:
        shown = ' and '.join(map(repr, named or fitting))
        raise UserError(
            f'{log}: {shown} both part it into columns; say which in the column map '
            "(delimiter: ';')"
        )
    there = [sign for sign in DELIMITERS if first and sign in first[0]]
    return [*named, *fitting, *there, ','][0]


def spaced(lines: Sequence[str]) -> bool:
    """Say whether spaces alone part all lines into as many columns, two at least."""
    first = [line for line in lines if line.strip()][:LOOKED_AT]
    if any(width(first, sign) > 1 for sign in DELIMITERS):
        return False
    return len(counts := {len(line.split()) for line in first}) == 1 and counts.pop() > 1


def width(lines: Sequence[str], delimiter: str) -> int:
    """Return how many columns each line has; 0 where they differ."""
    try:
        widths = {len(row) for row in csv.reader(lines, delimiter=delimiter)}
    except csv.Error:
        return 0
    return widths.pop() if len(widths) == 1 else 0


def decimal_of(cells: Iterable[str], log: str) -> str:
    """Return the decimal sign of numbers.

    Raises:
        UserError: there are both, or 1,234 may be a thousand as well as one and a bit.
    """
    texts = [cell.strip() for cell in cells]
    commas = [text for text in texts if _COMMA.fullmatch(text) or _THOUSANDS.fullmatch(text)]
    if not commas:
        return '.'
    point = next((text for text in texts if _POINT.fullmatch(text)), None)
    if point is not None:
        raise UserError(
            f'{log} has numbers like {commas[0][:20]} and like {point[:20]}; which is '
            "the decimal sign? Say it in the column map (decimal: ',') and mend the "
            'other ones'
        )
    if all(_THOUSANDS.fullmatch(text) for text in commas):
        raise UserError(
            f'{log}: is {commas[0][:20]} a thousand, or one and a bit? Say in the '
            "column map decimal: ',', or take the commas out"
        )
    return ','
