# SPDX-License-Identifier: Apache-2.0
"""Stamps that are frame / fps: computed, and so silent about when anything was measured.

LeRobot writes timestamp = frame_index / fps whatever the loop did. A clock that is read has
jitter; stamps that lie on an even grid to their own rounding (of float32, or of the digits they
were written with) were not read from one.
"""

from __future__ import annotations

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding, OK, WARNING

Array = np.ndarray
FEWEST = 30
DIGITS = range(7)
NEARLY_HALF = 0.55
"""Of the last digit: what rounding moves a stamp by, and the line through all of them."""
ROUNDING = 2e-9
"""Of stamps in a bag [s]."""
COARSEST = 0.25
"""Of the period: what is rounded more than that must be even as it stands."""
PACED = 100.0
"""From here on [Hz] a log is rather one of a real-time loop, whose stamps may be even."""


def even_stamps(recording: Recording) -> list[Finding]:
    """Say whether the stamps of an imported log are an even grid; a simulated robot's are."""
    episodes = [e.t - e.t[0] for e in recording.episodes if len(e.t) >= FEWEST]
    if 'imported_from' not in recording.metadata or not episodes:
        return []
    if not all(map(is_even, episodes)):
        return []
    rate = 1 / float(np.median(np.concatenate([np.diff(t) for t in episodes])))
    what = (
        f'stamps are frame / {rate:.4g} Hz, computed and not read from a clock: how late a '
        'frame really was cannot be seen'
    )
    todo = 'log the time at which each observation was read, and import that column as time'
    return [Finding('even_stamps', WARNING if rate < PACED else OK, what, (), todo)]


def is_even(t: Array) -> bool:
    """Say whether times that begin at 0 [s], shape (T,), are multiples of a period."""
    step = np.diff(t)
    period, rounded = float(np.median(step)), _rounded_to(t)
    frame = np.r_[0, np.cumsum(np.round(step / period))]
    off = t - np.polyval(np.polyfit(frame, t, 1), frame)
    digits = NEARLY_HALF * rounded if rounded <= COARSEST * period else 0.0
    allowed = max(float(np.spacing(np.float32(t[-1]))), digits) + ROUNDING
    return bool(np.abs(off).max() <= allowed)


def _rounded_to(t: Array) -> float:
    """Return the decimal that times are multiples of [s]; 0 for none."""
    for digits in DIGITS:
        step = 10.0**-digits
        if np.abs(t - step * np.round(t / step)).max() <= ROUNDING:
            return step
    return 0.0
