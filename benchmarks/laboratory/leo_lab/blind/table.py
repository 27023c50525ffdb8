# SPDX-License-Identifier: Apache-2.0
"""Rates with their 95 % intervals, and what was taken for what."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

SHARES = {
    'none': ('right',),
    'effect': ('right', 'family'),
    'pair': ('right', 'exact'),
    'triple': ('right', 'exact'),
    'outside': ('right', 'lone'),
    'small': ('right', 'largest_first', 'both', 'sure_wrong', 'extra', 'small_named_large'),
    'pushed': ('right', 'sure_wrong'),
    'strength': ('right', 'family', 'seen'),
    'fault': ('right', 'mended'),
    'sound': ('right', 'mended'),
}
"""What is counted of each kind of case; None does not count."""
Z95 = 1.959964


def summary(kind: str, rows: Sequence[dict]) -> dict:
    """Rates over the cases of one kind, with 95 % intervals."""
    seconds = [r['seconds'] for r in rows]
    return {
        'cases': len(rows),
        **{share: _rate([r[share] for r in rows]) for share in SHARES[kind]},
        'ambiguous': sum(r['verdict'] == 'ambiguous' for r in rows) / len(rows),
        **_parameters(rows),
        'seconds_median': float(np.median(seconds)),
        'seconds_max': float(np.max(seconds)),
    }


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Wilson 95 % interval of a rate; 0 to 1 where nothing counts."""
    if not count:
        return 0.0, 1.0
    share, weight = hits / count, Z95**2 / count
    middle = (share + weight / 2) / (1 + weight)
    half = np.sqrt(share * (1 - share) * weight + weight**2 / 4) / (1 + weight)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def _rate(values: Sequence[float | None]) -> dict:
    """How many are true, or more than 0, of those that count; their share and its interval."""
    counted = [bool(v) for v in values if v is not None]
    hits, n = sum(counted), len(counted)
    share = hits / n if n else None
    return {'hits': hits, 'n': n, 'rate': share, 'wilson95': [*wilson(hits, n)]}


def _parameters(rows: Sequence[dict]) -> dict:
    """Median error of the parameters, and the share of 95 % intervals that hold the truth."""
    errors = [e for r in rows for e in r['errors']]
    inside = [e['inside'] for e in errors if e['inside'] is not None]
    if not inside:
        return {}
    return {
        'parameter_error_median': float(np.median([e['error'] for e in errors])),
        'intervals': _rate(inside),
    }


def confusion(rows: Sequence[dict]) -> dict[str, dict[str, int]]:
    """{hidden: {answer: how often}}; answers are the first effects named, or the verdict."""
    table: dict[str, Counter[str]] = {}
    for row in rows:
        table.setdefault(hidden(row), Counter())[answer(row)] += 1
    return {name: dict(table[name].most_common()) for name in sorted(table)}


def by(rows: Sequence[dict], key: str) -> list[tuple[str, int, int]]:
    """(value, right, cases) for every value of a key of the rows."""
    values = sorted({str(r[key]) for r in rows})
    return [
        (v, sum(r['right'] for r in rows if str(r[key]) == v), sum(str(r[key]) == v for r in rows))
        for v in values
    ]


def hidden(row: dict) -> str:
    """The names of what is hidden in a case."""
    return ' + '.join(sorted(e['name'] for e in row['effects'])) or '-'


def answer(row: dict) -> str:
    """The names that a case was given; the verdict alone where it names none."""
    names = ' + '.join(sorted(name for name, _ in row['named']))
    return f'{row["verdict"]} {names}'.strip() if row['verdict'] != 'named' else names
