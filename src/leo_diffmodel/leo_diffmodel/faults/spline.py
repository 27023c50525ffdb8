# SPDX-License-Identifier: Apache-2.0
"""Cubic splines on even knots: their rows at any instants, and banded least squares for them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded
from scipy.sparse import csr_array

from leo_diffmodel.faults.settings import LIMITS

Array = np.ndarray
ORDER = 4  # basis functions that are not zero at an instant
PIECES = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6.0
"""Coefficients in u, u from 0 to 1 between two knots, of the four basis functions."""


@dataclass(frozen=True)
class Knots:
    """Of splines on several stretches: each sample has those of its own, (N,)."""

    begin: Array | float  # time of its first knot [s]
    offset: Array | int  # of its first coefficient among those of all stretches
    count: Array | int  # of its coefficients
    step: float  # between two knots [s]
    total: int  # of coefficients of all stretches

    def rows(self, t: Array, derivative: int = 0) -> csr_array:
        """Values, or derivatives, of the basis functions at the samples' t (N,): (N, total)."""
        place = np.clip((t - self.begin) / self.step, 0, self.count - ORDER + 1 - 1e-9)
        first = place.astype(int)
        degree, factor = np.arange(ORDER), np.ones(ORDER)  # of 1, u, u^2, u^3
        for k in range(derivative):
            factor *= np.maximum(degree - k, 0)
        powers = (place - first)[:, None] ** np.maximum(degree - derivative, 0)
        values = powers @ (PIECES * factor).T / self.step**derivative
        columns = (self.offset + first)[:, None] + degree
        ends = ORDER * np.arange(len(t) + 1)
        return csr_array((values.ravel(), columns.ravel(), ends), shape=(len(t), self.total))


def knots_of(times: Sequence[Array], step: float) -> Knots:
    """Knots of stretches with samples at these times, which go on beyond them."""
    counts = [int(np.ceil((t[-1] - t[0] + 2 * LIMITS.reach) / step)) + 4 for t in times]
    begins, offsets = [t[0] - LIMITS.reach for t in times], np.cumsum([0, *counts[:-1]])
    samples = [*map(len, times)]
    begin, offset, count = (np.repeat(x, samples) for x in (begins, offsets, counts))
    return Knots(begin, offset, count, step, sum(counts))


def solved(rows: csr_array, targets: Array) -> Array:
    """Least-squares coefficients (count, K) of targets (N, K)."""
    normal, bands = rows.T @ rows, np.zeros((ORDER, rows.shape[1]))
    for k in range(ORDER):
        bands[k, : rows.shape[1] - k] = normal.diagonal(k)
    bands[0] += LIMITS.ridge * bands[0].mean() + 1e-300
    return np.asarray(solveh_banded(bands, rows.T @ targets, lower=True))
