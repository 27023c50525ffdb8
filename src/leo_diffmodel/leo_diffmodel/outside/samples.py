# SPDX-License-Identifier: Apache-2.0
"""What samples say by themselves: noise, resolution, and fits that outliers do not move."""

from collections.abc import Callable, Sequence

import numpy as np

from leo_diffmodel.outside.settings import OUTSIDE

Array = np.ndarray
THIRD = 20.0  # variance of third differences of white noise of variance 1: 1 + 9 + 9 + 1


def integral(t: Array, values: Array) -> Array:
    """Of values (T, ...) on straight lines between samples at t (T,), from the first on."""
    area = 0.5 * np.diff(t) * (values[1:] + values[:-1]).T  # scipy.integrate takes long to load
    return np.concatenate([np.zeros_like(values[:1]), np.cumsum(area.T, axis=0)])


def spread(values: Array) -> float:
    """Standard deviation of a normal sample about 0, by its median size."""
    return 1.4826 * float(np.median(np.abs(values)))


def noise(parts: Sequence[Array]) -> float:
    """Of a channel in stretches (T,): what a smooth one would not do from sample to sample."""
    rough = np.concatenate([np.diff(part, 3) for part in parts])
    return spread(rough) / np.sqrt(THIRD) if rough.size else 0.0


def resolution(*parts: Array, quantile: float = 0.05) -> float:
    """The smallest step between neighbouring samples of stretches (N,); 0 where there is none."""
    step = np.abs(np.concatenate([np.diff(part) for part in parts]))
    moved = step[step > 0]
    return float(np.quantile(moved, quantile)) if moved.size else 0.0


def runs(inside: Array, part: Array | None = None) -> list[Array]:
    """Rows of each run of rows that are all inside (N,), of one and the same part (N,)."""
    cut = np.diff(inside.astype(int)) != 0
    if part is not None:
        cut |= np.diff(part) != 0
    found = np.split(np.arange(len(inside)), np.flatnonzero(cut) + 1)
    return [rows for rows in found if inside[rows[0]]]


def reweighted(
    solve: Callable[[Array], Array],
    columns: Array,
    y: Array,
    floor: float,
    huber: float = OUTSIDE.huber,
    rounds: int = OUTSIDE.rounds,
) -> tuple[Array, Array]:
    """Amounts of columns (N, P) that fit most of y (N,), whatever the others do; the weights (N,).

    `solve` gives the amounts for weights (N,). A sample counts less from `huber` standard
    deviations of what is left over on; `floor` is added to these.
    """
    weight = np.ones(len(y))
    for _ in range(rounds):
        amounts = solve(weight)
        weight = huber_weight(y - columns @ amounts, floor, huber)
    return amounts, weight


def huber_weight(rest: Array, floor: float, huber: float) -> Array:
    """Of samples by what is left over (N,); see `reweighted`."""
    size = spread(rest) + floor
    return np.asarray(np.minimum(1.0, huber * size / np.maximum(np.abs(rest), 1e-300)))


def block_covariance(inverse: Array, scores: Array, block: Array) -> Array:
    """Of P estimates, where errors are correlated within blocks (the clustered sandwich), (P, P).

    Of the inverse of the normal matrix (P, P), the weighted residual times column of each sample
    (N, P), and the number of its block (N,).
    """
    sums = np.stack([np.bincount(block, score) for score in scores.T], axis=1)
    blocks, count = sums.shape
    return np.asarray(inverse @ (sums.T @ sums) @ inverse * blocks / max(blocks - count, 1))
