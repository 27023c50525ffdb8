# SPDX-License-Identifier: Apache-2.0
"""Which unit a multiple stands for."""

from __future__ import annotations

import math

ANGLES = {
    180 / math.pi: 'degrees',
    1 / (2 * math.pi): 'turns',
    200 / math.pi: 'gons',
    4096 / (2 * math.pi): 'counts of 12 bits',
    1000.0: 'milliradians',
}
"""How many of a unit are one radian."""
SPEEDS = {
    180 / math.pi: 'degrees per second',
    30 / math.pi: 'revolutions per minute',
    1 / (2 * math.pi): 'revolutions per second',
    30 / math.pi / 0.229: 'steps of 0.229 rpm',
    1000.0: 'milliradians per second',
}
"""How many of a unit are one radian per second."""
NEAR = 0.01
"""Relative: how near a multiple is to the unit that is named."""


def unit_of(multiple: float, spread: float, units: dict[float, str]) -> str:
    """The unit that a multiple stands for, '' for none.

    Args:
        multiple: of radians (per second) in the log.
        spread: its standard deviation.
        units: `ANGLES` or `SPEEDS`.
    """
    near = [(abs(multiple / m - 1), name) for m, name in units.items()]
    off, name = min(near)
    return name if off < max(NEAR, 2 * spread / abs(multiple)) else ''
