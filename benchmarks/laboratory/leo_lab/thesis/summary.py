# SPDX-License-Identifier: Apache-2.0
"""What the lines of cases that differ by seed alone come to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

Row = dict[str, Any]
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Summary:
    """Best policies of n seeds, from the nominal start and from random ones.

    Attributes:
        n: seeds.
        best: best test return, over the seeds.
        median: median test return.
        mean, half: mean test return and half of its 95 % interval (Student's t); nan for one.
        distance: mean distance from the nominal start, m.
        best_distance: of the seed with the best return, m.
        footsteps: median of the seeds.
        passes: times the feet pass each other, median of the seeds.
        cost: median energy per metre, J/m; nan where nobody got forward.
        walked: seeds that walk `FAR` metres without a fall from the nominal start.
        upright: share of the random starts without a fall, all seeds.
        random_distance: mean distance from random starts, m.
    """

    n: int
    best: float
    median: float
    mean: float
    half: float
    distance: float
    best_distance: float
    footsteps: float
    passes: float
    cost: float
    walked: int
    upright: float
    random_distance: float


FAR, ENOUGH_FOOTSTEPS = 11.0, 15
"""What counts as walking: metres in an episode, and footsteps so that the legs alternate."""


def summary(rows: Sequence[Row]) -> Summary:
    """Of the lines of one group."""
    returns = np.array([row['test_return'] for row in rows])
    nominal = [row['nominal'] for row in rows]
    random = [walk for row in rows for walk in row['random']]
    costs = [w['energy_per_metre'] for w in nominal if w['energy_per_metre'] is not None]
    mean, half = mean_and_half(returns)
    return Summary(
        n=len(rows),
        best=float(returns.max()),
        median=float(np.median(returns)),
        mean=mean,
        half=half,
        distance=float(np.mean([walk['distance'] for walk in nominal])),
        best_distance=nominal[int(returns.argmax())]['distance'],
        footsteps=float(np.median([walk['footsteps'] for walk in nominal])),
        passes=float(np.median([walk['passes'] for walk in nominal])),
        cost=float(np.median(costs)) if costs else np.nan,
        walked=sum(map(walks, nominal)),
        upright=float(np.mean([not walk['fell'] for walk in random])),
        random_distance=float(np.mean([walk['distance'] for walk in random])),
    )


def walks(walk: Row) -> bool:
    """Whether an episode counts as walking."""
    far = walk['distance'] >= FAR and walk['footsteps'] >= ENOUGH_FOOTSTEPS
    return far and not walk['fell']


def mean_and_half(values: np.ndarray) -> tuple[float, float]:
    """Mean and half of its 95 % interval (Student's t); the half is nan for one value."""
    n = len(values)
    if n < 2:
        return float(values.mean()), np.nan
    t = stats.t.ppf(0.5 + CONFIDENCE / 2, n - 1)
    return float(values.mean()), float(t * values.std(ddof=1) / np.sqrt(n))


def common_curves(rows: Sequence[Row], points: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Tests of several runs on common steps: steps (K,) and returns (runs, K).

    Of each run the mean of its tests around a step counts, as single tests swing widely; steps
    that not every run has tests around are left out.
    """
    last = max(row['steps'] for row in rows)
    edges = np.linspace(0, last, points + 1)
    table = np.array([_means(np.array(row['curve'], float), edges) for row in rows])
    known = np.isfinite(table).all(axis=0)
    return (edges[1:] + edges[:-1])[known] / 2, table[:, known]


def _means(curve: np.ndarray, edges: np.ndarray) -> np.ndarray:
    steps, returns = curve.T
    count = np.histogram(steps, edges)[0]
    total = np.histogram(steps, edges, weights=returns)[0]
    with np.errstate(invalid='ignore', divide='ignore'):
        return total / count
