# SPDX-License-Identifier: Apache-2.0
"""A resonance between the input of a joint and its motion."""

from __future__ import annotations

import numpy as np
from scipy.signal import csd, find_peaks, welch

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.outside.samples import period
from leo_diffmodel.outside.settings import OUTSIDE


def resonance(recording: Recording, j: int) -> float | None:
    """Frequency [Hz] at which joint j answers its own input most; None where there is no peak.

    The answer is acceleration for a unit of the input: a rigid joint has no peak in it, and what
    friction, weight and their damping change is slow.
    """
    joint, step = recording.joints[j], period(recording)
    if joint not in recording.actuators:
        return None
    a, count = recording.actuators.index(joint), round(OUTSIDE.spectrum_seconds / step)
    long = [e for e in recording.episodes if len(e.t) >= 2 * count]
    if not long:
        return None
    e = max(long, key=lambda e: len(e.t))
    even = np.arange(e.t[0], e.t[-1], step)
    u, dq = (np.interp(even, e.t, x) for x in (e.inputs[:, a], e.dq[:, j]))
    hertz, power = welch(u, 1 / step, nperseg=count)
    answer = np.abs(csd(u, dq, 1 / step, nperseg=count)[1]) / np.maximum(power, 1e-300)
    slow, fast = OUTSIDE.peaks
    asked = (hertz > slow) & (hertz < fast) & (power > OUTSIDE.asked * power.max())
    heights = np.where(asked, 2 * np.pi * hertz * answer, 0.0)
    usual = float(np.median(heights[asked])) if asked.any() else 0.0
    peaks = [k for k in find_peaks(heights, OUTSIDE.peak * usual)[0] if asked[k - 1 : k + 2].all()]
    return float(hertz[max(peaks, key=heights.__getitem__)]) if peaks and usual > 0 else None
