# SPDX-License-Identifier: Apache-2.0
"""Logs at the rate of a camera: between two states more happens than can be seen."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding, WARNING
from leo_diffmodel.check.timing import steps

SLOWEST = 45.0
"""Hz. A position servo goes to a new goal within some 0.1 s: three states at 30 Hz."""


def slow(recording: Recording) -> list[Finding]:
    """Say where states come too rarely for friction at a turn, delay and backlash to show."""
    period = float(np.median(steps(recording)))
    if period <= 1 / SLOWEST:
        return []
    what = (
        f'joint states every {1e3 * period:.0f} ms ({1 / period:.3g} Hz): friction where a '
        'joint turns, delays and backlash happen in between'
    )
    todo = 'record at 100 Hz, 50 Hz at the least: the joints alone, no cameras in the loop'
    return [Finding('slow', WARNING, what, (), todo)]
