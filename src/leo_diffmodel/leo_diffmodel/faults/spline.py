# SPDX-License-Identifier: Apache-2.0
"""Cubic splines on even knots: their rows at any instants, and banded least squares for them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from leo_diffmodel.faults.settings import LIMITS

Array = np.ndarray
ORDER = 4  # basis functions that are not zero at an instant
PIECES = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6.0
"""Coefficients in u, u from 0 to 1 between two knots, of the four basis functions."""


@dataclass(frozen=True)
class Rows:
    """Rows of a linear map of spline coefficients, each with four neighbouring entries."""

    first: Array  # index of the first coefficient of each row, shape (N,)
    values: Array  # shape (N, 4)
    __array_ufunc__ = None

    def __add__(self, other: 'Rows') -> 'Rows':
        return Rows(self.first, self.values + other.values)

    def __rmul__(self, factor: float | Array) -> 'Rows':
        return Rows(self.first, np.reshape(factor, (-1, 1)) * self.values)

    def __matmul__(self, coefficients: Array) -> Array:
        picked = coefficients[self.first[:, None] + np.arange(ORDER)]
        return np.asarray((self.values * picked).sum(axis=1))

    @staticmethod
    def stacked(parts: 'Sequence[Rows]') -> 'Rows':
        first, values = zip(*((p.first, p.values) for p in parts), strict=True)
        return Rows(np.concatenate(first), np.concatenate(values))


@dataclass(frozen=True)
class Knots:
    begin: float  # time of the first knot [s]
    step: float  # between two knots [s]
    count: int  # of coefficients
    offset: int  # of the stretch's first coefficient among those of all stretches

    def rows(self, t: Array, derivative: int = 0) -> Rows:
        """Values, or derivatives, of the basis functions at t (N,)."""
        place = np.clip((t - self.begin) / self.step, 0, self.count - ORDER + 1 - 1e-9)
        first = place.astype(int)
        degree, factor = np.arange(ORDER), np.ones(ORDER)  # of 1, u, u^2, u^3
        for k in range(derivative):
            factor *= np.maximum(degree - k, 0)
        powers = (place - first)[:, None] ** np.maximum(degree - derivative, 0)
        return Rows(self.offset + first, powers @ (PIECES * factor).T / self.step**derivative)


def solved(rows: Rows, count: int, targets: Array) -> Array:
    """Least-squares coefficients (count, K) of targets (N, K)."""
    bands = np.zeros((ORDER, count))
    for a in range(ORDER):
        for b in range(a, ORDER):
            product = rows.values[:, a] * rows.values[:, b]
            bands[b - a] += np.bincount(rows.first + a, product, count)
    bands[0] += LIMITS.ridge * bands[0].mean() + 1e-300
    right = np.zeros((count, targets.shape[1]))
    for a in range(ORDER):
        for column, y in zip(right.T, targets.T, strict=True):
            column += np.bincount(rows.first + a, rows.values[:, a] * y, count)
    return np.asarray(solveh_banded(bands, right, lower=True))
