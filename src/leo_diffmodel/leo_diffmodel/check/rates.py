# SPDX-License-Identifier: Apache-2.0
"""Is the speed the derivative of the angle? Its scale and its lag, joint by joint."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, pairwise

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.check.finding import ERROR, Finding, OK, WARNING

Array = np.ndarray
SECONDS = 0.25
FEWEST = 12
SURE = 5.0
SCALE_OFF = 0.03
LAG_OFF = 0.002
LAG_PERIODS = 0.5
"""What happens between two samples, as after a step of the voltage, looks like a lag so long."""
CLEAR = 10.0
"""Times its noise that an integral must have on average: noise makes the scale look small."""


@dataclass(frozen=True)
class Rate:
    """Angle change = scale x integral of the rate `lag` later.

    Attributes:
        scale: of the angle against the rate, with its standard deviation.
        lag: by which the rate is late [s], with its standard deviation.
        period: from sample to sample [s].
    """

    scale: tuple[float, float]
    lag: tuple[float, float]
    period: float


def rates(recording: Recording) -> list[Finding]:
    """One finding per joint that moves enough to tell."""
    if recording.rates != 'measured':
        return []
    found = [(n, relate(recording, j)) for j, n in enumerate(recording.joints)]
    return list(chain.from_iterable(_judged(n, r) for n, r in found if r is not None))


def relate(recording: Recording, j: int) -> Rate | None:
    """Fit scale and lag of one joint over stretches of 0.25 s; None where it hardly moves.

    The integral hardly sees the noise of the rate, so the regression is not diluted by it.
    Weights are those of a robust fit: a mistimed sample shall not decide.
    """
    rows = [row for e in recording.episodes for row in _stretches(e, j)]
    if len(rows) < FEWEST:
        return None
    change, integral, ends = np.array(rows).T
    if np.abs(change).max() < 1e-9 or np.abs(integral).max() < 1e-9:
        return None
    period = float(np.median(np.concatenate([np.diff(e.t) for e in recording.episodes])))
    if np.sqrt((integral**2).mean()) < CLEAR * _noise(recording, j) * np.sqrt(SECONDS * period):
        return None
    columns = np.stack([integral, ends], axis=1)
    theta, covariance = _robust(columns, change)
    scale = theta[0], float(np.sqrt(covariance[0, 0]))
    lag = theta[1] / theta[0], float(np.sqrt(covariance[1, 1])) / abs(theta[0])
    return Rate(scale, lag, period)


def _noise(recording: Recording, j: int) -> float:
    """Of the rate, from what a smooth one would not do from sample to sample [rad/s]."""
    rough = np.concatenate([np.diff(e.dq[:, j], 3) for e in recording.episodes])
    return 1.4826 * float(np.median(np.abs(rough))) / np.sqrt(20) if rough.size else 0.0


def _stretches(e: Episode, j: int) -> list[tuple[float, float, float]]:
    """Angle change, integral of the rate, and change of the rate, over stretches."""
    period = float(np.median(np.diff(e.t)))
    count = max(4, round(SECONDS / period))
    area = np.r_[0.0, np.cumsum(0.5 * np.diff(e.t) * (e.dq[1:, j] + e.dq[:-1, j]))]
    edges = np.arange(0, len(e.t), count)
    return [
        (e.q[b, j] - e.q[a, j], area[b] - area[a], e.dq[b, j] - e.dq[a, j])
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


def _judged(joint: str, rate: Rate) -> list[Finding]:
    scale, lag = rate.scale, rate.lag
    out = []
    if abs(scale[0] - 1) > max(SCALE_OFF, SURE * scale[1]):
        what = (
            f'{joint}: the angle changes {scale[0]:.3f} ± {2 * scale[1]:.3f} times as much as '
            'the measured speed says'
        )
        todo = 'one of the two has the wrong unit or gear ratio: check the driver'
        out.append(Finding('rate_scale', ERROR, what, (), todo))
    if abs(lag[0]) > max(LAG_OFF, LAG_PERIODS * rate.period) + SURE * lag[1]:
        late = 'late' if lag[0] > 0 else 'early'
        what = (
            f'{joint}: the speed is {abs(1e3 * lag[0]):.1f} ± {2e3 * lag[1]:.1f} ms {late} '
            'against the angle'
        )
        todo = 'a filter in the driver? explain tries velocity_lag; else record the raw speed'
        out.append(Finding('rate_lag', WARNING, what, (), todo))
    if not out:
        what = f'{joint}: the speed is the derivative of the angle (scale {scale[0]:.3f})'
        out.append(Finding('rate', OK, what))
    return out
