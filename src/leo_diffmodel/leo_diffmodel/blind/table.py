# SPDX-License-Identifier: Apache-2.0
"""Rates with their confidence bounds, and what was taken for what."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from scipy.stats import beta


def upper_bound(hits: int, count: int) -> float:
    """Clopper-Pearson 95 % one-sided upper bound of a rate."""
    return 1.0 if hits == count else float(beta.ppf(0.95, hits + 1, count - hits))


def lower_bound(hits: int, count: int) -> float:
    """Clopper-Pearson 95 % one-sided lower bound of a rate."""
    return 0.0 if hits == 0 else float(beta.ppf(0.05, hits, count - hits + 1))


def summary(rows: Sequence[dict]) -> dict:
    """Rates over one set of cases, all with an effect or all without."""
    right, count = sum(r['right'] for r in rows), len(rows)
    seconds = [r['seconds'] for r in rows]
    return {
        'cases': count,
        'right': right,
        'rate': right / count,
        'rate_at_least': lower_bound(right, count),
        'wrong_at_most': upper_bound(count - right, count),
        'ambiguous': sum(r['verdict'] == 'ambiguous' for r in rows) / count,
        'seconds_median': float(np.median(seconds)),
        'seconds_max': float(np.max(seconds)),
    }


def mistakes(rows: Sequence[dict]) -> list[tuple[str, str, int]]:
    """(truth, answer, how often) of the wrong ones, most frequent first."""
    wrong = Counter(
        (str(r['truth']), f'{r["verdict"]}: {r["named"] or "-"}') for r in rows if not r['right']
    )
    return [(truth, answer, count) for (truth, answer), count in wrong.most_common()]


def by_effect(rows: Sequence[dict]) -> list[tuple[str, int, int]]:
    """(effect, right, cases) for each true effect."""
    names = sorted({str(r['truth']) for r in rows})
    return [
        (n, sum(r['right'] for r in rows if str(r['truth']) == n),
         sum(str(r['truth']) == n for r in rows))
        for n in names
    ]  # fmt: skip
