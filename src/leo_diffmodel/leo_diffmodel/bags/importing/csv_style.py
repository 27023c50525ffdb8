# SPDX-License-Identifier: Apache-2.0
"""What parts the columns of a CSV file, and what its decimal sign is; told, or refused."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import csv
import re

from leo_msgs_py.errors import UserError

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
