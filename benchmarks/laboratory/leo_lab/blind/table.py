# SPDX-License-Identifier: Apache-2.0
"""Rates with their confidence bounds, and what was taken for what."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from scipy.stats import beta

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
TWO_SIDED = ('small', 'pushed', 'fault', 'sound')
"""Kinds whose rates have Wilson intervals."""
Z95 = 1.959964


def upper_bound(hits: int, count: int) -> float:
    """Clopper-Pearson 95 % one-sided upper bound of a rate."""
    return 1.0 if hits == count else float(beta.ppf(0.95, hits + 1, count - hits))


def lower_bound(hits: int, count: int) -> float:
    """Clopper-Pearson 95 % one-sided lower bound of a rate."""
    return 0.0 if hits == 0 else float(beta.ppf(0.05, hits, count - hits + 1))


def summary(kind: str, rows: Sequence[dict]) -> dict:
    """Rates over the cases of one kind, with one-sided 95 % bounds."""
    seconds = [r['seconds'] for r in rows]
    return {
        'cases': len(rows),
        **{share: _share(kind, [r[share] for r in rows]) for share in SHARES[kind]},
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


def _share(kind: str, values: Sequence[float | None]) -> dict:
    """The rate of those that are true, or more than 0."""
    counted = [bool(v) for v in values if v is not None]
    if kind not in TWO_SIDED:
        return rate(sum(counted), len(counted))
    low, high = wilson(sum(counted), len(counted))
    share = sum(counted) / len(counted) if counted else None
    return {'hits': sum(counted), 'n': len(counted), 'rate': share, 'wilson95': [low, high]}


def rate(hits: int, count: int) -> dict:
    """How many, which share, and between what it is at 95 % confidence (each side alone)."""
    return {
        'hits': hits,
        'rate': hits / count,
        'at_least': lower_bound(hits, count),
        'at_most': upper_bound(hits, count),
    }


def _parameters(rows: Sequence[dict]) -> dict:
    """Median error of the parameters, and the share of 95 % intervals that hold the truth."""
    errors = [e for r in rows for e in r['errors']]
    inside = [e['inside'] for e in errors if e['inside'] is not None]
    if not inside:
        return {}
    return {
        'parameter_error_median': float(np.median([e['error'] for e in errors])),
        'intervals': rate(sum(inside), len(inside)),
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
