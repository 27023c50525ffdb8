# SPDX-License-Identifier: Apache-2.0
"""Logs without measured speeds: what differences of the positions are worth.

A central difference of angles with steps (or noise) of size d, h apart, is off by
d / sqrt(12) / (sqrt(2) h) rms.
"""

from __future__ import annotations

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding, OK, WARNING
from leo_diffmodel.check.timing import steps
from leo_diffmodel.outside.frozen import resolution

COARSE = 0.05
"""Of a joint's speed: what differences may be off by."""
TOLD = {
    'absent': 'positions only: speeds are their differences',
    'made': 'positions only: the logged speeds are their differences, and were made anew',
}


def positions_only(recording: Recording) -> list[Finding]:
    """Say how coarse the speeds of a log are that measured none, for the worst joint."""
    if recording.rates not in TOLD:
        return []
    off, share, joint = max(
        (_coarseness(recording, j) for j in range(len(recording.joints))), key=lambda c: c[1]
    )
    what = (
        f'{TOLD[recording.rates]}, coarse to {off:.2g} rad/s at {joint}, '
        f'{100 * share:.0f} % of how fast it moves'
    )
    todo = 'log the speed that the servo itself measures; delays and filters of speeds show there'
    return [Finding('positions_only', WARNING if share > COARSE else OK, what, (), todo)]


def _coarseness(recording: Recording, j: int) -> tuple[float, float, str]:
    """Return what the speeds of joint j are off by [rad/s], the same of its speed, its name."""
    finest = max(resolution(e.q[:, j]) for e in recording.episodes)
    off = finest / np.sqrt(24) / float(np.median(steps(recording)))
    speed = float(np.sqrt(np.mean(np.concatenate([e.dq[:, j] for e in recording.episodes]) ** 2)))
    return off, off / speed if speed else 0.0, recording.joints[j]
