# SPDX-License-Identifier: Apache-2.0
"""Sensors that stand still while the other one says that the joint moves."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.check.finding import ERROR, Finding, merged, times

Array = np.ndarray
LEAST_SECONDS = 0.08
LEAST_SAMPLES = 5
LEAST_MOVE = 0.02
RESOLUTIONS = 4.0


def stuck(recording: Recording) -> list[Finding]:
    """One finding per joint and sensor that got stuck."""
    out = []
    for j, joint in enumerate(recording.joints):
        for name, sensor in (('angle', _angle), ('speed', _speed)):
            found = merged((s for e in recording.episodes for s in sensor(e, j)), 0.1)
            if found:
                what = f'{joint}: its {name} stands still while the joint moves: {times(found)}'
                todo = 'encoder or bus lost samples: mend it, or leave these stretches out'
                out.append(Finding('stuck', ERROR, what, found, todo))
    return out


def _angle(e: Episode, j: int) -> list[tuple[float, float]]:
    """Stretches in which the angle keeps one value although the speed adds up."""
    area = np.r_[0.0, np.cumsum(0.5 * np.diff(e.t) * (e.dq[1:, j] + e.dq[:-1, j]))]
    least = max(LEAST_MOVE, RESOLUTIONS * _resolution(e.q[:, j]))
    return [
        (float(e.t[a]), float(e.t[b]))
        for a, b in _constant(e.t, e.q[:, j])
        if abs(area[b] - area[a]) > least
    ]


def _speed(e: Episode, j: int) -> list[tuple[float, float]]:
    """Stretches in which the speed keeps one value and the angle does not go along."""
    coarse = RESOLUTIONS * _resolution(e.dq[:, j])
    out = []
    for a, b in _constant(e.t, e.dq[:, j]):
        seconds = float(e.t[b] - e.t[a])
        off = abs(e.q[b, j] - e.q[a, j] - e.dq[a, j] * seconds)
        if off > LEAST_MOVE + coarse * seconds:
            out.append((float(e.t[a]), float(e.t[b])))
    return out


def _constant(t: Array, values: Array) -> list[tuple[int, int]]:
    """First and last sample of each stretch of one and the same value."""
    edges = np.flatnonzero(np.diff(values) != 0)
    first, last = np.r_[0, edges + 1], np.r_[edges, len(values) - 1]
    long = (t[last] - t[first] >= LEAST_SECONDS) & (last - first >= LEAST_SAMPLES - 1)
    return list(zip(first[long].tolist(), last[long].tolist(), strict=True))


def _resolution(values: Array) -> float:
    """The smallest step between neighbouring samples; 0 where there is none."""
    step = np.abs(np.diff(values))
    moved = step[step > 0]
    return float(np.quantile(moved, 0.05)) if moved.size else 0.0
