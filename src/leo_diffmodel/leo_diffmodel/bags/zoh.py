# SPDX-License-Identifier: Apache-2.0
"""Inputs that hold from stamp to stamp, averaged over the steps of the states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def average(
    t: NDArray[np.int64], stamps: NDArray[np.int64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the mean of a held signal over each step.

    Args:
        t: state stamps [ns], shape (T,), increasing, t[0] >= stamps[0].
        stamps: input stamps [ns], shape (N,), increasing; `values[i]` holds from `stamps[i]`
            to `stamps[i + 1]`, the last one for ever.
        values: shape (N, A).

    Returns:
        Shape (T, A): row k is the mean over [t[k], t[k + 1]], exactly the held value where no
        stamp lies inside; the last row is the value held at t[-1].
    """
    first = np.searchsorted(stamps, t, side='right') - 1
    held = values[first]
    last = np.searchsorted(stamps, t[1:], side='left') - 1
    mixed = np.flatnonzero(last > first[:-1])
    if mixed.size:
        area = _area(t, stamps, values, first)
        width = (t[mixed + 1] - t[mixed])[:, None]
        held[mixed] = (area[mixed + 1] - area[mixed]) / width
    return held


def _area(
    t: NDArray[np.int64],
    stamps: NDArray[np.int64],
    values: NDArray[np.float64],
    first: NDArray[np.intp],
) -> NDArray[np.float64]:
    """Integrate the held signal from stamps[0] to each t; shape (T, A), unit x ns."""
    steps = np.diff(stamps)[:, None] * values[:-1]
    before = np.vstack([np.zeros((1, values.shape[1])), np.cumsum(steps, axis=0)])
    return before[first] + (t - stamps[first])[:, None] * values[first]
