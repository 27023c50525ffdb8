# SPDX-License-Identifier: Apache-2.0
"""Is what a hypothesis leaves only noise: correlation in time, and size by condition."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare.conditions import conditions
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray
LAGS = 10
DRAWS = 60
SEED = 0
PUSH_TIMES = 5.0
BAND = (0.025, 0.975)
LASTING = 2.0
SHOWN = ('speed', 'direction', 'load', 'motor')


@dataclass(frozen=True)
class Correlation:
    """Autocorrelation of the residual, and that of white noise treated alike.

    Projecting initial states out correlates even white noise, so the band comes from draws of
    white noise through the same projection.

    Attributes:
        seconds: of each lag, shape (L,).
        value: of each lag and channel (angles, then rates), shape (L, 2J).
        low: lower end of the 95 % band of white noise, shape (L, 2J).
        high: its upper end.
        strength: mean square of the autocorrelations, each in standard deviations of what white
            noise gives: 1 for white noise.
        white: the strength is at most 2, or one that white noise reached.
    """

    seconds: Array
    value: Array
    low: Array
    high: Array
    strength: float
    white: bool


def correlation(problem: Problem, fitted: Fit) -> Correlation:
    """Autocorrelation at up to ten samples; windows far worse than most take no part."""
    windows = problem.windows
    inliers = np.flatnonzero(chi_squared(fitted) < PUSH_TIMES * np.median(chi_squared(fitted)))
    linear = problem.take(inliers).linearised(
        fitted.hypothesis, fitted.theta, fitted.start[inliers]
    )
    basis = np.linalg.qr(linear.by_start)[0]
    lags = np.arange(1, 1 + min(LAGS, windows.steps - 1))
    channels = fitted.start.shape[-1]
    rng, drawn = np.random.default_rng(SEED), []
    for _ in range(DRAWS):
        noise = rng.standard_normal((*linear.residual.shape, 1))
        rest = noise - basis @ (np.swapaxes(basis, -1, -2) @ noise)
        drawn.append(_autocorrelation(rest[..., 0], channels, lags))
    value = _autocorrelation(fitted.residual[inliers], channels, lags)
    middle, spread = np.mean(drawn, axis=0), np.std(drawn, axis=0)
    strength = float((((value - middle) / spread) ** 2).mean())
    highest = float((((np.array(drawn) - middle) / spread) ** 2).mean(axis=(1, 2)).max())
    low, high = np.quantile(drawn, BAND, axis=0)
    seconds = lags * float(np.median(windows.dt))
    return Correlation(seconds, value, low, high, strength, strength <= max(highest, LASTING))


def chi_squared(fitted: Fit) -> Array:
    """Mean squared whitened residual of each window over its expected value, shape (W,)."""
    free = fitted.residual.shape[-1] - fitted.start.shape[-1]
    return (fitted.residual**2).sum(axis=-1) / free


def by_condition(problem: Problem, before: Fit, after: Fit) -> list[dict]:
    """Rows {joint, variable, bin, unit, windows, before, after}: median ratios by condition."""
    names = problem.base.robot.joint_names
    early, late = chi_squared(before), chi_squared(after)
    return [
        {
            'joint': names[c.joint],
            'variable': c.variable,
            'bin': c.bin if isinstance(c.bin, str) else list(c.bin),
            'unit': c.unit,
            'windows': int(c.inside.sum()),
            'before': float(np.median(early[c.inside])),
            'after': float(np.median(late[c.inside])),
        }
        for c in conditions(problem.windows, problem.base, most=3)
        if c.variable in SHOWN
    ]


def _autocorrelation(residual: Array, channels: int, lags: Array) -> Array:
    """Of each lag and channel, over all windows, shape (L, C)."""
    e = residual.reshape(len(residual), -1, channels)
    power = (e**2).sum(axis=(0, 1))
    return np.stack([(e[:, k:] * e[:, :-k]).sum(axis=(0, 1)) for k in lags]) / power
