# SPDX-License-Identifier: Apache-2.0
"""Hand pushes and collisions: torques that come once, whatever the state and the input are."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding, merged, OK, times, WARNING
from leo_diffmodel.compare.sizes import stall_torque
from leo_diffmodel.compare.torque import missing_torque, MissingTorque
from leo_sim.model import Model

Array = np.ndarray
NEIGHBOURS = 12
SIGMAS = 8.0
LEAST_SHARE = 0.05
BLOW_SHARE = 0.5
NEAR_SECONDS = 0.3
ADJACENT = 0.12
BEFORE_SECONDS = 0.05


def disturbances(recording: Recording, model: Model, sigma: Array) -> list[Finding]:
    """One finding: the stretches in which something unknown pushed.

    An effect that the model lacks gives the same missing torque whenever angle, speed and input
    are alike. A push does not: the missing torque of its window stands out from that of the
    windows that are alike at other times.

    Args:
        recording: the bag.
        model: its model.
        sigma: noise, shape (1, 2J).
    """
    missing = _settled(recording, missing_torque([recording], model, sigma))
    if len(missing.time) < 3 * NEIGHBOURS:
        return []
    alone = missing.torque - _typical(missing, _before(recording, missing))
    out = []
    for j, joint in enumerate(recording.joints):
        stall = stall_torque(model.robot, joint) or 0.0
        found = _standing_out(missing, alone[:, j], j, stall)
        if found:
            share = _size(model, joint, float(np.abs(alone[:, j]).max()))
            what = f'something pushed {joint}: {times(found)}, up to {share}'
            todo = 'a hand, a stop or a cable? record again without, or leave that time out'
            out.append(Finding('push', WARNING, what, found, todo))
    return out or [Finding('push', OK, 'no hand push, no collision')]


def _settled(recording: Recording, missing: MissingTorque) -> MissingTorque:
    """Without the first instants of each episode: what was applied before them is not known."""
    begins = np.array([e.t[0] for e in recording.episodes])
    last = begins[np.searchsorted(begins, missing.windows.start + 1e-9, side='right') - 1]
    return missing.take(np.flatnonzero(missing.windows.start - last > BEFORE_SECONDS))


def _before(recording: Recording, missing: MissingTorque) -> Array:
    """Mean input over the time just before each window, (W, A): effects may be late."""
    t = np.concatenate([e.t for e in recording.episodes])
    inputs = np.concatenate([e.inputs for e in recording.episodes])
    area = np.vstack([np.zeros(inputs.shape[1]), np.cumsum(inputs[:-1] * np.diff(t)[:, None], 0)])
    begin = missing.windows.start
    ends = [np.stack([np.interp(at, t, a) for a in area.T], axis=1) if area.size else area
            for at in (begin - BEFORE_SECONDS, begin)]  # fmt: skip
    return (ends[1] - ends[0]) / BEFORE_SECONDS


def _typical(missing: MissingTorque, before: Array) -> Array:
    """Median missing torque of the windows with the most similar state and input, (W, J)."""
    held = missing.windows.inputs
    features = np.concatenate(
        [np.sin(missing.q), np.cos(missing.q), missing.dq, held[:, 0], held[:, -1], before],
        axis=1,
    )
    spread = np.maximum(features.std(axis=0), 1e-9)
    _, near = cKDTree(features / spread).query(features / spread, k=NEIGHBOURS + 1)
    apart = np.abs(missing.time[near] - missing.time[:, None]) > NEAR_SECONDS
    torque = np.where(apart[..., None], missing.torque[near], np.nan)
    with np.errstate(all='ignore'):
        return np.nan_to_num(np.nanmedian(torque, axis=1))


def _standing_out(
    missing: MissingTorque, alone: Array, j: int, stall: float
) -> tuple[tuple[float, float], ...]:
    """Stretches of two windows or more that stand out, or one that does so by far."""
    usual = 1.4826 * float(np.median(np.abs(alone - np.median(alone))))
    limit = np.maximum(SIGMAS * np.maximum(usual, missing.spread[:, j]), LEAST_SHARE * stall)
    size = np.abs(alone)
    begin, length = missing.windows.start, missing.windows.dt.sum(axis=1)
    worst = np.flatnonzero(size > limit)
    found = merged(((float(begin[w]), float(begin[w] + length[w])) for w in worst), ADJACENT)
    inside = [(begin[worst] >= a) & (begin[worst] < b) for a, b in found]
    return tuple(
        stretch for stretch, mask in zip(found, inside, strict=True)
        if mask.sum() > 1 or size[worst][mask].max() > max(BLOW_SHARE * stall, 2 * limit.min())
    )  # fmt: skip


def _size(model: Model, joint: str, torque: float) -> str:
    stall = stall_torque(model.robot, joint)
    told = f'{torque:.2g} N m'
    return told if stall is None else f'{told} ({100 * torque / stall:.0f} % of stall)'
