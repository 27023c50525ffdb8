# SPDX-License-Identifier: Apache-2.0
"""Short torques that come from nothing the robot has: shoves and collisions."""

from __future__ import annotations

from dataclasses import dataclass
import warnings

import numpy as np
from scipy.spatial import cKDTree

from leo_diffmodel.outside.flow import Flow

Array = np.ndarray
SIGMAS, WIDE = 8.0, 0.3
LOCAL_SHARE, USUAL_SHARE = 0.05, 0.05
"""Of the torque at work within `AROUND`, and of what usually is: less is no push."""
AROUND = 0.3
NEIGHBOURS, APART, MOST = 12, 0.5, 4000
FEWEST = 2
MOVING = 0.3
EDGE, STOPPED = 0.05, 0.3


@dataclass(frozen=True)
class Burst:
    """One short torque.

    Attributes:
        begin: [s].
        end: [s].
        size: the largest torque in it [N m, N].
        stopped: it stops the joint at an end of where it ever went.
    """

    begin: float
    end: float
    size: float
    stopped: bool


def bursts(flow: Flow, rest: Array, j: int, fitted: Array) -> list[Burst]:
    """What stands out of the torque left over at joint j (N,).

    It must do so twice: out of what is left over elsewhere, and out of what is left over in
    states and under inputs like those, so that an unknown law of angle and speed is no push.
    """
    usual = 1.4826 * float(np.median(np.abs(rest[fitted])))
    limit = _limit(flow, j, usual, fitted)
    out = (np.abs(rest) > limit) & (flow.moving[:, j] > MOVING)
    if not out.any():
        return []
    both = _surely(flow, rest, j, np.abs(rest) > WIDE * limit)
    sure = out & (both > limit)
    return [
        _burst(flow, rest, j, group, both) for group in _groups(flow, both > WIDE * limit, sure)
    ]


def _limit(flow: Flow, j: int, usual: float, fitted: Array) -> Array:
    own = flow.own[:, j]
    step = float(np.median(np.diff(flow.time)))
    half = max(1, round(AROUND / max(step, 1e-9)))
    padded = np.pad(own, half, mode='edge')
    nearby = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1).max(axis=1)
    often = float(np.quantile(own[fitted], 0.9))
    limit: Array = SIGMAS * usual + np.maximum(LOCAL_SHARE * nearby, USUAL_SHARE * often)
    return limit


def _surely(flow: Flow, rest: Array, j: int, wanted: Array) -> Array:
    """How far each wanted instant stands out of everything that was alike (N,), the least."""
    one = [flow.q[:, j], flow.dq[:, j], flow.sign[:, j]]
    before = np.moveaxis(flow.before, 0, -1).reshape(len(rest), -1)
    whole = [*flow.q.T, *flow.dq.T, *flow.sign.T, *flow.motor.T, *flow.enabled.T, *before.T]
    joints = flow.q.shape[1]
    least = np.where(wanted, np.abs(rest), 0.0)
    for features, angles in ((one, 1), (whole, joints)):
        turns = [f(x) for x in features[:angles] for f in (np.sin, np.cos)]
        columns = np.stack([*turns, *features[angles:]], axis=1)
        alone = rest - _typical(flow.time, rest, columns, wanted)
        least = np.minimum(least, np.where(rest * alone > 0, np.abs(alone), 0.0))
    return least


def _typical(time: Array, rest: Array, features: Array, wanted: Array) -> Array:
    """Median of the rest where the features were most alike at other times; 0 if unwanted."""
    features = features / np.maximum(features.std(axis=0), 1e-9)
    known = np.unique(np.linspace(0, len(rest) - 1, MOST).astype(int))
    _, near = cKDTree(features[known]).query(features[wanted], k=min(4 * NEIGHBOURS, len(known)))
    near = known[near]
    apart = np.abs(time[near] - time[wanted][:, None]) > APART
    first = apart & (np.cumsum(apart, axis=1) <= NEIGHBOURS)
    out = np.zeros(len(rest))
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', RuntimeWarning)
        out[wanted] = np.nan_to_num(np.nanmedian(np.where(first, rest[near], np.nan), axis=1))
    return out


def _groups(flow: Flow, wide: Array, sure: Array) -> list[Array]:
    """Runs of instants that stand out at all, of those that surely do in two instants or more."""
    cut = (np.diff(flow.episode) != 0) | (np.diff(wide.astype(int)) != 0)
    runs = np.split(np.arange(len(wide)), np.flatnonzero(cut) + 1)
    return [run for run in runs if wide[run[0]] and sure[run].sum() >= FEWEST]


def _burst(flow: Flow, rest: Array, j: int, run: Array, both: Array) -> Burst:
    half = 0.25 * flow.bell
    begin, end = float(flow.time[run[0]]) - half, float(flow.time[run[-1]]) + half
    return Burst(begin, end, float(both[run].max()), _stops(flow, rest, j, run))


def _stops(flow: Flow, rest: Array, j: int, run: Array) -> bool:
    """Whether the torque opposes the motion, ends it, and the joint is where it turns back."""
    low, high = flow.q[:, j].min(), flow.q[:, j].max()
    at, first = flow.q[run, j], max(run[0] - 1, 0)
    last = min(run[-1] + 1, len(rest) - 1)
    peak = run[np.argmax(np.abs(rest[run]))]
    before, after = flow.dq[first, j], flow.dq[last, j]
    edge = EDGE * (high - low)
    outmost = at.max() > high - edge if before > 0 else at.min() < low + edge
    return bool(outmost and rest[peak] * before < 0 and after * before < STOPPED * before**2)
