# SPDX-License-Identifier: Apache-2.0
"""The angle against the integral of the measured rate: scale and lag of one joint."""

from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.outside.samples import Array, integral, noise, reweighted, spread
from leo_diffmodel.outside.settings import OUTSIDE

TINY = 1e-12  # rad, m: keeps weights finite where a fit is exact


@dataclass(frozen=True)
class Rate:
    """Angle change = scale x integral of the rate, less its zero, `lag` later."""

    scale: tuple[float, float]  # of the angle against the rate, with its standard deviation
    lag: tuple[float, float]  # by which the rate is late [s], with its standard deviation
    zero: tuple[float, float]
    """What the rate is where the joint stands [rad/s, m/s], with its standard deviation."""


def with_true_rates(recording: Recording) -> Recording:
    """With rates from the angle where the measured one cannot be its derivative.

    That is one in another unit, of the other sign, late, with a zero that is off, or none.
    """
    wrong = np.array([_is_wrong(recording, j) for j in range(len(recording.joints))])
    if not wrong.any():
        return recording
    right = (replace(e, dq=np.where(wrong, _slopes(e), e.dq)) for e in recording.episodes)
    return replace(recording, episodes=tuple(right))


def _is_wrong(recording: Recording, j: int) -> bool:
    change, integral, _, seconds = stretches(recording, j)
    missed, moved, usual = (_usual(x) for x in (change - integral, change, change / seconds))
    found = relate(recording, j)
    if found is not None:
        (scale, sigma), lag, zero = found.scale, found.lag, found.zero
        late, off = OUTSIDE.rate_late, OUTSIDE.rate_off
        limits = (lag, late), ((scale - 1, sigma), off), (zero, off * usual)
        if any(abs(value) > most + OUTSIDE.rate_sigmas * s for (value, s), most in limits):
            return True
    both = np.hypot(_noise(recording, j, 'q'), _noise_of_integral(recording, j))
    return bool(missed > OUTSIDE.rate_unlike * moved + OUTSIDE.rate_noises * both)


def _usual(moved: Array) -> float:
    """What nine of ten stretches do not exceed: a jump of the angle in one is no rate's fault."""
    return float(np.quantile(np.abs(moved), 0.9)) if len(moved) else 0.0


def _slopes(e: Episode) -> Array:
    """Of the angle, about each sample (T, J)."""
    half = max(OUTSIDE.rate_across, e.period)
    before, after = (np.clip(e.t + s * half, e.t[0], e.t[-1]) for s in (-1, 1))
    moved = [np.interp(after, e.t, q) - np.interp(before, e.t, q) for q in e.q.T]
    return np.stack(moved, axis=1) / (after - before)[:, None]


def relate(recording: Recording, j: int) -> Rate | None:
    """Scale, lag and zero of one joint over stretches of 0.25 s; None where it hardly moves.

    The integral has hardly any of the rate's noise, which would make the scale look small.
    `faults.motion` estimates the same for the answer; this one takes milliseconds.
    """
    change, integral, ends, seconds = stretches(recording, j)
    if len(change) < OUTSIDE.rate_fewest:
        return None
    if np.abs(change).max() < 1e-9 or np.abs(integral).max() < 1e-9:
        return None
    if np.sqrt((integral**2).mean()) < OUTSIDE.rate_clear * _noise_of_integral(recording, j):
        return None
    columns = np.stack([integral, ends, -seconds], axis=1)

    def solve(weight: Array) -> Array:
        root = np.sqrt(weight)
        return np.asarray(np.linalg.lstsq(columns * root[:, None], change * root, rcond=None)[0])

    huber, rounds = OUTSIDE.rate_huber, OUTSIDE.rate_rounds
    theta, weight = reweighted(solve, columns, change, TINY, huber, rounds)
    inverse = np.linalg.pinv(columns.T @ (columns * weight[:, None]))
    sigma = (spread(change - columns @ theta) + TINY) * np.sqrt(np.diag(inverse))
    scale = float(theta[0])
    lag, zero = ((float(theta[i]) / scale, float(sigma[i]) / abs(scale)) for i in (1, 2))
    return Rate((scale, float(sigma[0])), lag, zero)


def _noise_of_integral(recording: Recording, j: int) -> float:
    """Of the rate's, over one stretch [rad, m]."""
    wide = float(np.sqrt(OUTSIDE.rate_seconds * recording.state_period))
    return _noise(recording, j, 'dq') * wide


def _noise(recording: Recording, j: int, name: str) -> float:
    return noise([getattr(e, name)[:, j] for e in recording.episodes])


def stretches(recording: Recording, j: int) -> Array:
    """Angle change, integral of the rate, change of the rate, and seconds, of stretches (4, S)."""
    parts = []
    for e in recording.episodes:
        count = max(4, round(OUTSIDE.rate_seconds / e.period))
        channels = np.stack([e.q[:, j], integral(e.t, e.dq[:, j]), e.dq[:, j], e.t])
        parts.append(np.diff(channels[:, ::count]))
    return np.concatenate(parts, axis=1)
