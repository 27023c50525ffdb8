# SPDX-License-Identifier: Apache-2.0
"""Goals that are wrapped apart from the angle: brought to the turn that the angle is in.

An angle that goes on over a turn and a goal that was wrapped at pi for itself are 2 pi apart,
and no servo is. A goal that steps far is none: the joint then goes there the long way.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np
from numpy.typing import NDArray

from .states import Floats

NEAR = 1.0
"""rad: so near its goal, less whole turns, a joint mostly is where the goal counts from
another turn."""
MOSTLY = 0.9
"""Share of the goals."""


def on_the_angles_turn(
    goals: Floats, on: NDArray[np.bool_], angles: Floats, joints: Sequence[str]
) -> tuple[Floats, list[str]]:
    """Goals less the turns by which they were wrapped apart; also which, one line each.

    Args:
        goals: rad, shape (N, A).
        on: whether the goal counts, shape (N, A); a free motor has none.
        angles: of the same joints when the goals begin, unwrapped, shape (N, A); NaN for a slide.
        joints: their names.
    """
    out, told = goals.copy(), []
    for a, name in enumerate(joints):
        counts = on[:, a] & np.isfinite(angles[:, a]) & np.isfinite(goals[:, a])
        turns = _turns(goals[counts, a], angles[counts, a])
        if turns.any():
            out[counts, a] -= math.tau * turns
            told.append(
                f'{int((turns != 0).sum())} goals of {name} were wrapped apart from its '
                'angle; brought to the turn it is in'
            )
    return out, told


def _turns(goal: Floats, angle: Floats) -> Floats:
    """Whole turns that a goal is off by, shape (N,); zeros where it may be meant."""
    off = goal - angle
    nearest = np.round(off / math.tau)
    none = np.zeros_like(goal)
    if not nearest.any():
        return none
    near = np.abs(off - math.tau * nearest) < NEAR
    if _leaps(goal - math.tau * nearest) < _leaps(goal) and near[nearest != 0].mean() >= MOSTLY:
        return nearest
    most = float(np.median(nearest))
    same = np.abs(off - math.tau * most) < NEAR
    return none + most if most and same.mean() >= MOSTLY else none


def _leaps(goal: Floats) -> int:
    """How often a goal steps by more than half a turn."""
    return int((np.abs(np.diff(goal)) > math.tau / 2).sum())
