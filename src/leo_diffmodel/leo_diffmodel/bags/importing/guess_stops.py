# SPDX-License-Identifier: Apache-2.0
"""The unit of an angle by the joint of a known robot: whether it slides, where its stops are."""

from __future__ import annotations

import numpy as np

from .expression import Column
from .guess_robot import KnownRobot
from .guess_units import peak_of, RADIANS, Unit

OVER_A_STOP = 1.1
"""So many times the angle of a stop is reached by a joint that gives, and by its calibration."""


def of_joint(robot: KnownRobot, joint: str, values: Column) -> Unit | None:
    """Return the unit in which a position is one of the joint; None where none is."""
    reach, peak = robot.reach(joint), peak_of([values])
    if joint in robot.slides:
        return Unit('m', f'{joint} of {robot.ref} slides')
    if not np.isfinite(reach):
        open_one = Unit('?', f'{joint} of {robot.ref} turns round: unit: rad or deg')
        return open_one if peak > RADIANS else None
    if peak <= reach * OVER_A_STOP:
        return Unit('rad', f'within the stops of {robot.ref}, {reach:.3g} rad')
    if np.radians(peak) <= reach * OVER_A_STOP and peak > RADIANS:
        return Unit('deg', f'within the stops of {robot.ref}, {np.degrees(reach):.0f} deg; '
                    'of per cent of a range scale: rad for 1 %')
    return None


def of_per_cent(robot: KnownRobot, joint: str) -> Unit | None:
    """Return what per cent would be if the calibrated range went from stop to stop."""
    low, high = robot.limits.get(joint, (-np.inf, np.inf))
    if not np.isfinite(high - low):
        return None
    return Unit('?', 'numbers end at exactly 100: per cent of the calibrated range; from stop '
                f'to stop of {robot.ref} scale: {(high - low) / 200:.4g} for -100 to 100,'
                f' {(high - low) / 100:.4g} for 0 to 100')
