# SPDX-License-Identifier: Apache-2.0
"""The angle against the integral of the measured rate: scale and lag of one joint."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording

Array = np.ndarray
SECONDS = 0.25
FEWEST = 12
CLEAR = 10.0
"""Times its noise that an integral must have on average: noise makes the scale look small."""
LATE, OFF, SIGMAS = 0.004, 0.03, 5.0
"""A rate is wrong that is so late [s], so wrongly scaled, or has a zero of so much of what it
usually is, and so many standard deviations beyond it."""
UNLIKE, NOISES = 0.35, 3.0
"""Of what the angle changes in 0.25 s, beside so many times the noise: a rate whose integral
misses more is not its derivative. Of real robots 0.03 at most, 0.23 where it is 20 ms late."""
ACROSS = 0.005
"""s before and after, between which angles give a rate: noise of neighbours would drown it."""


@dataclass(frozen=True)
class Rate:
    """Angle change = scale x integral of the rate, less its zero, `lag` later.

    Attributes:
        scale: of the angle against the rate, with its standard deviation.
        lag: by which the rate is late [s], with its standard deviation.
        zero: what the rate is where the joint stands [rad/s, m/s], with its standard deviation.
        period: from sample to sample [s].
    """

    scale: tuple[float, float]
    lag: tuple[float, float]
    zero: tuple[float, float]
    period: float


def with_true_rates(recording: Recording) -> Recording:
    """The recording with rates from the angle where the measured one cannot be its derivative.

    That is one in another unit, of the other sign, late, with a zero that is off, or none.
    """
    wrong = np.array([_is_wrong(recording, j) for j in range(len(recording.joints))])
    if not wrong.any():
        return recording
    return replace(
        recording,
        episodes=tuple(
            replace(e, dq=np.where(wrong, _slopes(e), e.dq)) for e in recording.episodes
        ),
    )


def _is_wrong(recording: Recording, j: int) -> bool:
    rows = [row for e in recording.episodes for row in _stretches(e, j)]
    change, integral, _, seconds = np.array(rows).reshape(-1, 4).T
    missed, moved, usual = (_usual(x) for x in (change - integral, change, change / seconds))
    found = relate(recording, j)
    if found is not None:
        (scale, sigma), lag, zero = found.scale, found.lag, found.zero
        off = (lag, LATE), ((scale - 1, sigma), OFF), (zero, OFF * usual)
        if any(abs(value) > least + SIGMAS * s for (value, s), least in off):
            return True
    noise = np.hypot(_noise(recording, j, 'q'), _noise_of_integral(recording, j))
    return bool(missed > UNLIKE * moved + NOISES * noise)


def _usual(moved: Array) -> float:
    """What nine of ten stretches do not exceed: a jump of the angle in one is no rate's fault."""
    return float(np.quantile(np.abs(moved), 0.9)) if len(moved) else 0.0


def _slopes(e: Episode) -> Array:
    """Of the angle, about each sample (T, J)."""
    half = max(ACROSS, float(np.median(np.diff(e.t))))
    before, after = (np.clip(e.t + s * half, e.t[0], e.t[-1]) for s in (-1, 1))
    moved = [np.interp(after, e.t, q) - np.interp(before, e.t, q) for q in e.q.T]
    return np.stack(moved, axis=1) / (after - before)[:, None]


def relate(recording: Recording, j: int) -> Rate | None:
    """Fit scale, lag and zero of one joint over stretches of 0.25 s; None where it hardly moves.

    The integral hardly sees the noise of the rate, so the regression is not diluted by it.
    Weights are those of a robust fit: a mistimed sample shall not decide.
    """
    rows = [row for e in recording.episodes for row in _stretches(e, j)]
    if len(rows) < FEWEST:
        return None
    change, integral, ends, seconds = np.array(rows).T
    if np.abs(change).max() < 1e-9 or np.abs(integral).max() < 1e-9:
        return None
    if np.sqrt((integral**2).mean()) < CLEAR * _noise_of_integral(recording, j):
        return None
    columns = np.stack([integral, ends, -seconds], axis=1)
    theta, covariance = _robust(columns, change)
    sigma = np.sqrt(np.diag(covariance))
    scale = float(theta[0])
    lag, zero = ((float(theta[i]) / scale, float(sigma[i]) / abs(scale)) for i in (1, 2))
    return Rate((scale, float(sigma[0])), lag, zero, _period(recording))


def _period(recording: Recording) -> float:
    return float(np.median(np.concatenate([np.diff(e.t) for e in recording.episodes])))


def _noise_of_integral(recording: Recording, j: int) -> float:
    """Of the rate's, over one stretch [rad, m]."""
    return _noise(recording, j, 'dq') * float(np.sqrt(SECONDS * _period(recording)))


def _noise(recording: Recording, j: int, name: str) -> float:
    """Of angle or rate, from what a smooth one would not do from sample to sample."""
    rough = np.concatenate([np.diff(getattr(e, name)[:, j], 3) for e in recording.episodes])
    return 1.4826 * float(np.median(np.abs(rough))) / np.sqrt(20) if rough.size else 0.0


def _stretches(e: Episode, j: int) -> list[tuple[float, float, float, float]]:
    """Angle change, integral of the rate, change of the rate, and seconds, of stretches."""
    period = float(np.median(np.diff(e.t)))
    count = max(4, round(SECONDS / period))
    area = np.r_[0.0, np.cumsum(0.5 * np.diff(e.t) * (e.dq[1:, j] + e.dq[:-1, j]))]
    edges = np.arange(0, len(e.t), count)
    return [
        (e.q[b, j] - e.q[a, j], area[b] - area[a], e.dq[b, j] - e.dq[a, j], e.t[b] - e.t[a])
        for a, b in pairwise(edges)
    ]


def _robust(columns: Array, y: Array) -> tuple[Array, Array]:
    weight = np.ones(len(y))
    for _ in range(8):
        root = np.sqrt(weight)[:, None]
        theta = np.linalg.lstsq(columns * root, y * root[:, 0], rcond=None)[0]
        rest = y - columns @ theta
        size = 1.4826 * float(np.median(np.abs(rest))) + 1e-12
        weight = np.minimum(1.0, 2.0 * size / np.maximum(np.abs(rest), 1e-300))
    gram = columns.T @ (columns * weight[:, None])
    return theta, size**2 * np.linalg.pinv(gram)
