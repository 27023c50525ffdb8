# SPDX-License-Identifier: Apache-2.0
"""What the motors behind an emulated bus were asked for: how far, how fast, until when."""

from collections.abc import Sequence

import numpy as np

Rows = Sequence[tuple[float, np.ndarray]]
"""Times [s] and goals of all motors [rad], NaN where free, at each change."""
WINDOW = 0.2
"""Over which a speed is taken [s]: packets wait for a processor, here by ms."""


def beyond(rows: Rows, bounds: np.ndarray) -> float:
    """How far a goal was outside its bounds, (2, A), at most [rad]; 0 within."""
    goals = np.array([goal for _, goal in rows])
    return float(np.nanmax([bounds[0] - goals, goals - bounds[1]], initial=0.0))


def fastest(rows: Rows, period: float) -> tuple[float, float]:
    """The fastest goal over a window [rad/s], and the largest step of one [rad].

    Goals come once a period [s]: in a window one more may fall than it is long. A motor that was
    free in between begins anew.
    """
    times, goals = np.array([t for t, _ in rows]), np.array([goal for _, goal in rows])
    rate = step = 0.0
    for k in range(len(times) - 1):
        step = max(step, float(np.nanmax(np.abs(goals[k + 1] - goals[k]), initial=0.0)))
        end = int(np.searchsorted(times, times[k] + WINDOW)) - 1
        whole = np.isfinite(goals[k : end + 1]).all(axis=0)
        gone = np.abs(goals[end] - goals[k])[whole]
        rate = max(rate, float(gone.max(initial=0.0)) / (WINDOW + period))
    return rate, step


def last_change(rows: Rows, until: float) -> float:
    """When a motor last had another goal or was freed, before a time [s]."""
    return max((t for t, _ in rows if t <= until), default=-np.inf)
