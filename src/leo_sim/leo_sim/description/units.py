# SPDX-License-Identifier: Apache-2.0
"""Units of joints that slide, from those of joints that turn."""

PAIRS = (('N m', 'N'), ('kg m2', 'kg'), ('rad', 'm'), ('turn', 'm'))
"""Unit of turning, unit of sliding."""


def sliding(unit: str) -> str:
    """The unit on a slide of what has this unit on a hinge: `N m s/rad` is `N s/m`."""
    for turning, along in PAIRS:
        unit = unit.replace(turning, along)
    return unit
