# SPDX-License-Identifier: Apache-2.0
"""Where trajectories want one joint at any time: straight from goal to goal, then held.

As ros2_controllers' joint_trajectory_controller goes: a trajectory starts at its stamp, or when
it comes if that is 0; it leads from where the goal was (at first: where the joint was) to its
first point, straight from point to point, and holds the last one. A new one replaces what is left
of the former. Points whose time is over when it comes are passed over. Where points have
velocities the controller draws a spline; straight lines are off from it by less than a point
from its neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .states import Floats, Stamps


class Leg(NamedTuple):
    """What one message asks of a joint.

    Attributes:
        begin: from when on it counts [ns].
        times: when the joint is to be there [ns], shape (K,), increasing.
        goals: where [rad, m], shape (K,), K at least 1.
    """

    begin: int
    times: Stamps
    goals: Floats


def sampled(legs: Sequence[Leg], stamps: Stamps, first: float) -> Floats:
    """The goal at times [ns] (N,), increasing; NaN before the first leg.

    Args:
        legs: in the order of their begin.
        stamps: when it is wanted.
        first: where the joint is as the first leg begins.
    """
    out = np.full(len(stamps), np.nan)
    was = first
    for k, leg in enumerate(legs):
        end = legs[k + 1].begin if k + 1 < len(legs) else None
        inside = stamps >= leg.begin
        if end is not None:
            inside &= stamps < end
        out[inside] = _along(leg, was, stamps[inside])
        if end is not None:
            was = float(_along(leg, was, np.array([end]))[0])
    return out


def _along(leg: Leg, was: float, stamps: Stamps) -> Floats:
    """The goal of one leg that leads away from `was`."""
    ahead = leg.times > leg.begin
    at_once = leg.goals[~ahead][-1] if not ahead.all() and _counts_at_once(leg, ahead) else was
    times = np.concatenate([[leg.begin], leg.times[ahead]])
    goals = np.concatenate([[at_once], leg.goals[ahead]])
    return np.asarray(np.interp(stamps - leg.begin, times - leg.begin, goals))


def _counts_at_once(leg: Leg, ahead: np.ndarray) -> bool:
    """Say whether a point whose time has come counts: one of now, or the last of all."""
    return bool(leg.times[~ahead][-1] == leg.begin or not ahead.any())
