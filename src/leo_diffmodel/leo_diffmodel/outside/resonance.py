# SPDX-License-Identifier: Apache-2.0
"""A resonance between the input of a joint and its motion."""

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.outside.settings import OUTSIDE


def resonance(recording: Recording, j: int) -> float | None:
    """Frequency [Hz] at which joint j answers its own input most; None where there is no peak.

    The answer is acceleration for a unit of the input, where the two are coherent: a rigid joint
    has no peak in it.
    """
    joint, step = recording.joints[j], recording.state_period
    if joint not in recording.actuators:
        return None
    a, count = recording.actuators.index(joint), round(OUTSIDE.spectrum_seconds / step)
    e = max(recording.episodes, key=lambda e: len(e.t))
    even = np.arange(e.t[0], e.t[-1], step)
    if len(even) < 2 * count:
        return None

    from scipy.signal import coherence, csd, find_peaks, welch  # half a second, and seldom asked

    u, dq = (np.interp(even, e.t, x) for x in (e.inputs[:, a], e.dq[:, j]))
    hertz, asked = coherence(u, dq, 1 / step, nperseg=count)
    known = (asked > OUTSIDE.coherent) & (hertz > OUTSIDE.peaks[0]) & (hertz < OUTSIDE.peaks[1])
    if known.sum() < OUTSIDE.fewest_lines:
        return None
    answer = np.abs(csd(u, dq, 1 / step, nperseg=count)[1]) * hertz
    heights = np.where(known, answer / welch(u, 1 / step, nperseg=count)[1], 0.0)
    least = OUTSIDE.peak * float(np.median(heights[known]))
    peaks = [k for k in find_peaks(heights, least)[0] if known[k - 1 : k + 2].all()]
    return float(hertz[max(peaks, key=heights.__getitem__)]) if peaks else None
