# SPDX-License-Identifier: Apache-2.0
"""Velocities that were not measured but made from the positions, told by their noise.

What a joint does is smooth; what differs from sample to sample is noise of the sensor, or its
steps. A speed that repeats the noise of the differences of the angle, and not only the motion,
is those differences.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .states import Floats, Stamps, StateLog

ALIKE = 0.02
"""Of the roughness of a difference: what a speed that is made of it may be off by."""
ROUGH = 1e-4
"""Of the speed: what is smoother has no noise to be told by, and its differences are good."""
MOST = 0.9
FEWEST = 20


def without_made_rates(states: StateLog) -> tuple[StateLog, str]:
    """Leave out velocities that are differences of the positions; also return which ones ('')."""
    with np.errstate(all='ignore'):  # whatever numbers a bag holds
        found = '' if states.dq is None else _made(states, states.dq)
    return (replace(states, dq=None), found) if found else (states, '')


def _made(states: StateLog, dq: Floats) -> str:
    """As `made_from`, of the joints whose rate is there."""
    there = np.isfinite(dq).all(axis=0)
    return made_from(states.stamp_ns, states.q[:, there], dq[:, there])


def made_from(stamp_ns: Stamps, q: Floats, dq: Floats) -> str:
    """Return which difference of the positions (T, J) the velocities (T, J) are; '' for none.

    All joints that say something must agree: those whose differences are rough in 20 samples.
    """
    if len(q) < FEWEST or not (np.diff(stamp_ns) > 0).all():
        return ''
    t = (stamp_ns - stamp_ns[0]) * 1e-9
    step, middle = np.diff(q, axis=0) / np.diff(t)[:, None], (t[1:] + t[:-1]) / 2
    central = np.gradient(q, t, axis=0)
    ways = {
        'backward': (middle[:-1], step[:-1]),
        'forward': (middle[1:], step[1:]),
        'central': (t[1:-1], central[1:-1]),
    }
    found = (way for way, (at, difference) in ways.items() if _repeats(at, difference, dq[1:-1]))
    return next(found, '')


def _repeats(at: Floats, difference: Floats, dq: Floats) -> bool:
    """Say whether velocities are a difference to a small part of its roughness.

    Args:
        at: times that the differences are of [s], shape (N,).
        difference: of the positions [rad/s], shape (N, J).
        dq: the velocities, shape (N, J).
    """
    slope = np.diff(difference, axis=0) / np.diff(at)[:, None]
    rough = np.abs(np.diff(slope, axis=0)) * (at[2:] - at[:-2])[:, None] / 2
    off = np.abs(dq - difference)[1:-1]
    speed = np.sqrt(np.mean(np.square(dq), axis=0))
    told = [_share(off[:, j], rough[:, j], float(speed[j])) for j in range(dq.shape[1])]
    shares = [share for share in told if share is not None]
    return bool(shares) and min(shares) >= MOST


def _share(off: Floats, rough: Floats, speed: float) -> float | None:
    """Return the share of rough samples (N,) that are alike; None where there are too few."""
    moved = rough > ROUGH * speed
    if moved.sum() < FEWEST:
        return None
    return float((off[moved] <= ALIKE * np.median(rough[moved])).mean())
