# SPDX-License-Identifier: Apache-2.0
"""Binned means: what a cloud of noisy estimates says against one variable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Array = np.ndarray
PER_BIN = 10
LEAST_BINS, MOST_BINS = 12, 40
FEWEST = 6
TAIL = 0.005


@dataclass(frozen=True)
class Bins:
    """Samples sorted into bins of equal width by one variable.

    Attributes:
        centre: mean of the variable in each bin, shape (B,).
        members: which samples lie in each bin, shape (B, W).
    """

    centre: Array
    members: Array

    def mean(self, values: Array) -> Array:
        """Mean of `values` (W,) in each bin, shape (B,)."""
        return np.array([values[m].mean() for m in self.members])

    def standard_error(self, values: Array) -> Array:
        """Standard error of that mean, shape (B,)."""
        return np.array([values[m].std(ddof=1) / np.sqrt(m.sum()) for m in self.members])

    def explained(self, values: Array) -> float:
        """Share of the mean square of `values` (W,) that the means of the bins stand for."""
        square = sum(float((values[m] ** 2).sum()) for m in self.members)
        return float(self.members.sum(axis=1) @ self.mean(values) ** 2) / (square or 1.0)


def sort(variable: Array, count: int | None = None) -> Bins:
    """Bins over all but the outermost samples; those with fewer than six samples are left out.

    Args:
        variable: what to sort by, shape (W,).
        count: number of bins; by default one for ten samples, within 12 to 40.
    """
    count = count or int(np.clip(len(variable) // PER_BIN, LEAST_BINS, MOST_BINS))
    low, high = np.quantile(variable, (TAIL, 1 - TAIL))
    edges = np.linspace(low, high, count + 1)
    index = np.clip(np.searchsorted(edges, variable, side='right') - 1, 0, count - 1)
    inside = (variable >= low) & (variable <= high)
    groups = [inside & (index == b) for b in range(count)]
    kept = [g for g in groups if g.sum() >= FEWEST]
    centre = np.array([variable[g].mean() for g in kept])
    return Bins(centre, np.array(kept, dtype=bool).reshape(len(kept), len(variable)))
