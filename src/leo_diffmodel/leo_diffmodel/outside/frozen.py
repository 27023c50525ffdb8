# SPDX-License-Identifier: Apache-2.0
"""Sensors that keep one value while the other one says that the joint moves."""

from typing import NamedTuple

import numpy as np

from leo_diffmodel.bags.episode import merged
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.outside.samples import Array, integral, resolution
from leo_diffmodel.outside.settings import OUTSIDE


class Frozen(NamedTuple):
    joint: str
    sensor: str  # angle or speed
    at_end: bool  # the values are the largest or smallest that the sensor ever showed
    spans: tuple[tuple[float, float], ...]
    """Begin and end of each since the recording's first state [s]."""


def frozen(recording: Recording) -> list[Frozen]:
    """Where a sensor keeps one value and the other goes on."""
    out = []
    for j, joint in enumerate(recording.joints):
        for sensor, find, name in (('angle', _angle, 'q'), ('speed', _speed, 'dq')):
            values = np.concatenate([getattr(e, name)[:, j] for e in recording.episodes])
            ends = values.min(), values.max()
            found = [(e, a, b) for e in recording.episodes for a, b in find(e, j)]
            for at_end in (False, True):
                same = [
                    (float(e.t[a]), float(e.t[b]))
                    for e, a, b in found
                    if (getattr(e, name)[a, j] in ends) == at_end
                ]
                out.append(Frozen(joint, sensor, at_end, merged(same, OUTSIDE.frozen_adjacent)))
    return [f for f in out if f.spans]


def _angle(e: Episode, j: int) -> list[tuple[int, int]]:
    """First and last samples of stretches of one angle although the speed adds up."""
    area = integral(e.t, e.dq[:, j])
    least = max(OUTSIDE.frozen_move, OUTSIDE.frozen_resolutions * resolution(e.q[:, j]))
    fastest = float(np.abs(e.dq[:, j]).max())
    slowest = max(OUTSIDE.frozen_slowest * fastest, 2 * resolution(e.dq[:, j]))
    return [
        (a, b)
        for a, b in _constant(e.t, e.q[:, j])
        if np.ptp(area[a : b + 1]) > max(least, slowest * (e.t[b] - e.t[a]))
    ]


def _speed(e: Episode, j: int) -> list[tuple[int, int]]:
    """First and last samples of stretches of one speed that its angle contradicts, if it moves."""
    coarse = OUTSIDE.frozen_resolutions * resolution(e.dq[:, j])
    slowest = OUTSIDE.frozen_slowest * float(np.abs(e.dq[:, j]).max())
    out = []
    for a, b in _constant(e.t, e.dq[:, j]):
        seconds = float(e.t[b] - e.t[a])
        after = e.q[min(b + 1, len(e.q) - 1), j]
        stands = abs(after - e.q[a, j]) < OUTSIDE.frozen_move
        off = abs(e.q[b, j] - e.q[a, j] - e.dq[a, j] * seconds)
        if off > OUTSIDE.frozen_move + max(coarse, slowest * stands) * seconds:
            out.append((a, b))
    return out


def _constant(t: Array, values: Array) -> list[tuple[int, int]]:
    """First and last sample of each stretch of one and the same value."""
    edges = np.flatnonzero(np.diff(values) != 0)
    first, last = np.r_[0, edges + 1], np.r_[edges, len(values) - 1]
    long = t[last] - t[first] >= OUTSIDE.frozen_seconds
    long &= last - first >= OUTSIDE.frozen_samples - 1
    return list(zip(first[long].tolist(), last[long].tolist(), strict=True))
