# SPDX-License-Identifier: Apache-2.0
"""The unit of a column by its numbers, '?' where they may be in one as well as another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .expression import Column

RADIANS = 4 * np.pi
"""Angles of joints seldom go beyond two turns."""
PER_CENT = 100.5
DEGREES = 720.0
FASTEST, SLOWEST = 20e3, 2.0
"""Rates at which robots are logged [Hz]."""
SECONDS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}


class Unit(NamedTuple):
    """A unit and why."""

    name: str
    why: str


def of_angles(columns: Sequence[Column]) -> Unit:
    """Return the unit of angles that belong together: one of each joint, and their goals."""
    finite = [np.abs(c[np.isfinite(c)]).max(initial=0.0) for c in columns]
    peak = max(finite, default=0.0)
    if peak <= RADIANS:
        return Unit('rad', f'none is beyond {peak:.3g}, so radians')
    if peak > DEGREES:
        return Unit('?', f'up to {peak:.4g}: counts of an encoder? then scale: rad for one')
    if peak > PER_CENT:
        return Unit('deg', f'up to {peak:.3g}: beyond two turns in rad, and beyond per cent; '
                    'unit: rad for a joint that turns round')
    return Unit('?', f'up to {peak:.3g}: unit: deg, or of per cent of a range scale: rad for 1 %')


def of_time(column: Column) -> Unit:
    """Return the unit in which a time goes on as robots are logged."""
    steps = np.diff(column[np.isfinite(column)])
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    for unit, seconds in SECONDS.items():
        if step and SLOWEST <= 1 / (step * seconds) <= FASTEST:
            return Unit(unit, f'{step:.4g} from row to row, so {1 / (step * seconds):.4g} Hz')
    return Unit('?', f'{step:.4g} from row to row')


def is_per_cent(column: Column) -> bool:
    """Say whether values may be per cent from an end of a range."""
    return bool(np.nanmin(column) >= -1.0 and np.nanmax(column) <= PER_CENT)
