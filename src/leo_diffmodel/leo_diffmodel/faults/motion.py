# SPDX-License-Identifier: Apache-2.0
"""One smooth motion that the angle and the speed of a joint must both agree with.

The logged speed is w(t) = scale p'(t) + zero and the logged angle q(t) = p(t + late) +
filter p'(t + late), of a motion p that is a cubic spline: a speed that comes late, or through a
first-order filter, is one that the angle is ahead of. Noise of both channels is estimated and
both are fitted (errors in variables): noise of the speed does not make its scale look small.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array, diags_array, vstack
from scipy.special import huber

from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.faults.spline import Array, knots_of, solved
from leo_diffmodel.outside.samples import block_covariance, huber_weight, noise, resolution, spread

TINY = 1e-300
NAMES = ('scale', 'late', 'filter', 'zero')


class Channels(NamedTuple):
    """Times (T,) [s], angles [rad] and speeds [rad/s] of one joint in one stretch."""

    t: Array
    q: Array
    dq: Array


@dataclass(frozen=True)
class Law:
    theta: Array  # scale, late [s], filter [s], zero [rad/s]
    covariance: Array  # of these, from blocks of 1 s; 0 of what was not fitted
    loss: float  # Huber loss of both channels [nats]
    weight: Array  # of each sample of both channels

    def of(self, name: str) -> tuple[float, float]:
        i = NAMES.index(name)
        return float(self.theta[i]), float(np.sqrt(self.covariance[i, i]))


@dataclass(frozen=True)
class _Point:
    """Parameters, the weight of each sample, what is left over (2N,), its slopes (2N, P)."""

    theta: Array
    weight: Array
    rest: Array
    slope: Array

    @cached_property
    def inverse(self) -> Array:
        """Of the normal matrix, whose parameters have sizes of their own (P, P)."""
        size = np.sqrt((self.weight[:, None] * self.slope**2).sum(axis=0)) + TINY
        scaled = self.slope / size
        normal = scaled.T @ (self.weight[:, None] * scaled)
        return np.asarray(np.linalg.pinv(normal, LIMITS.alike_columns) / np.outer(size, size))

    @property
    def step(self) -> tuple[Array, Array]:
        """Of Gauss-Newton, and the standard deviations of the parameters."""
        deviation = (spread(self.rest) + TINY) * np.sqrt(self.inverse.diagonal())
        return self.inverse @ (self.slope.T @ (self.weight * self.rest)), deviation


class Motion:
    """Both channels of one joint, and the splines on which they must meet."""

    def __init__(self, parts: Sequence[Channels]) -> None:
        self.parts = [p._replace(q=p.q - p.q.mean()) for p in parts]
        self.period = float(np.median(np.concatenate([np.diff(p.t) for p in parts])))
        self.t, self.q, self.dq = map(np.concatenate, zip(*self.parts, strict=True))
        self.knots = knots_of([p.t for p in parts], LIMITS.knots * self.period)
        self.block = _blocks(self.parts)
        self.sigma = np.array([_noise(self.parts, n) for n in ('q', 'dq')])

    @property
    def signals(self) -> Array:
        """Variance of angle and speed, each as a multiple of its noise's, shape (2,)."""
        return np.array([self.q.var(), self.dq.var()]) / self.sigma**2

    def tuned(self, start: Array) -> Law:
        """All four parameters, and the noise of both channels with them."""
        for _ in range(LIMITS.tunings):
            law = self.fit(NAMES, start)
            self.sigma, start = self._noises(law), law.theta
        return self.fit(NAMES, start)

    def fit(self, free: Sequence[str], start: Array) -> Law:
        """The robust least-squares fit of the `free` parameters, by steps halved if need be."""
        index = [NAMES.index(name) for name in free]
        at = self._point(np.array(start, float), np.ones(2 * len(self.q)), index)
        for _ in range(LIMITS.most_steps):
            step, sd = at.step
            nearer = self._nearer(at, step, index)
            if nearer is None:
                break
            moved, at = nearer.theta[index] - at.theta[index], nearer
            if (np.abs(moved) < LIMITS.step_near * sd).all():
                break
        return self._law(at, index)

    def _nearer(self, at: _Point, step: Array, index: Sequence[int]) -> _Point | None:
        """A point along the step with a smaller loss, by the weights of where it begins."""
        most = LIMITS.farthest * self.period
        times = [abs(s) for i, s in zip(index, step, strict=True) if i in (1, 2)]
        step = most / max([most, *times]) * step
        for _ in range(LIMITS.halvings):
            theta = at.theta.copy()
            theta[index] += step
            theta[1:3] = np.clip(theta[1:3], -LIMITS.reach, LIMITS.reach)
            theta[0] = np.clip(theta[0], -LIMITS.largest_scale, LIMITS.largest_scale)
            there = self._point(theta, at.weight, index)
            if np.square(there.rest) @ at.weight < np.square(at.rest) @ at.weight:
                return there
            step = 0.5 * step
        return None

    def _point(self, theta: Array, weight: Array, index: Sequence[int]) -> _Point:
        rest, slope = self._linear(theta, weight, index)
        return _Point(theta, huber_weight(rest, TINY, LIMITS.motion_huber), rest, slope)

    def _law(self, at: _Point, index: Sequence[int]) -> Law:
        """Its covariance is the larger of what blocks and what single samples say."""
        scores = (at.weight * at.rest)[:, None] * at.slope
        apart = block_covariance(at.inverse, scores, self.block)
        squares = float((at.weight * at.rest**2).sum())
        alone = at.inverse * squares / max(2 * len(self.q) - self.knots.total, 1)
        ratio = np.sqrt(np.maximum(alone.diagonal() / np.maximum(apart.diagonal(), 1e-300), 1.0))
        covariance = np.zeros((len(NAMES), len(NAMES)))
        covariance[np.ix_(index, index)] = apart * np.outer(ratio, ratio)
        loss = float(huber(LIMITS.motion_huber, at.rest).sum())
        return Law(at.theta, covariance, loss, at.weight)

    def _rows(self, theta: Array) -> tuple[csr_array, csr_array, csr_array, csr_array]:
        """Rows of angle and speed, and of p' and p'' where the angle sees them."""
        p, dp, ddp = (self.knots.rows(self.t + theta[1], d) for d in range(3))
        return p + theta[2] * dp, self.knots.rows(self.t, 1), dp, dp + theta[2] * ddp

    def _whitened(self, theta: Array) -> tuple[csr_array, Array]:
        """Rows of both channels and what they should give, in standard deviations."""
        angle, speed, _, _ = self._rows(theta)
        sq, sw = self.sigma
        rows = vstack([(1 / sq) * angle, (theta[0] / sw) * speed], format='csr')
        return rows, np.r_[self.q / sq, (self.dq - theta[3]) / sw]

    def _linear(self, theta: Array, weight: Array, index: Sequence[int]) -> tuple[Array, Array]:
        """What the best spline leaves over (2N,), and its change with the parameters (2N, P)."""
        (rows, y), root = self._whitened(theta), np.sqrt(weight)
        weighted = diags_array(root) @ rows
        spline = solved(weighted, (root * y)[:, None])[:, 0]
        _, speed, rate, change = self._rows(theta)
        sq, sw = self.sigma
        each = np.zeros((2, len(self.q), len(NAMES)))
        each[1, :, 0] = (speed @ spline) / sw
        each[0, :, 1] = (change @ spline) / sq
        each[0, :, 2] = (rate @ spline) / sq
        each[1, :, 3] = 1.0 / sw
        columns = each.reshape(-1, len(NAMES))[:, list(index)]
        seen = solved(weighted, root[:, None] * columns)
        return y - rows @ spline, columns - rows @ seen

    def _noises(self, law: Law) -> Array:
        (rows, y), root = self._whitened(law.theta), np.sqrt(law.weight)
        probes = np.random.default_rng(0).choice([-1.0, 1.0], (len(y), LIMITS.probes))
        weighted = diags_array(root) @ rows
        found = solved(weighted, np.column_stack([root * y, probes]))
        rest = root * (y - rows @ found[:, 0])
        spent = (probes * (weighted @ found[:, 1:])).mean(axis=1)
        left = np.maximum((law.weight - spent).reshape(2, -1).sum(axis=1), 0.02 * len(self.q))
        sizes = np.sqrt((rest**2).reshape(2, -1).sum(axis=1) / left)
        least = LIMITS.floor * np.array([np.ptp(self.q), np.ptp(self.dq)]) + 1e-12
        return np.maximum(self.sigma * sizes, least)


def coarse(parts: Sequence[Channels], period: float) -> Array:
    """Where to start: scale and lateness of the speed by cross-correlation, filter and zero 0."""
    reach = int(LIMITS.reach / period)
    crossed, power = np.zeros(2 * reach + 1), 0.0
    for part in parts:
        grid = np.arange(part.t[0], part.t[-1], period)
        slope = np.gradient(np.interp(grid, part.t, part.q), period)
        speed = np.interp(grid, part.t, part.dq)
        slope, speed = (np.pad(x - x.mean(), reach) for x in (slope, speed))
        crossed += np.correlate(speed, slope[reach:-reach], mode='valid')
        power += float(slope @ slope)
    best = int(np.argmax(np.abs(crossed)))
    return np.array([crossed[best] / max(power, 1e-300), (best - reach) * period, 0.0, 0.0])


def _blocks(parts: Sequence[Channels]) -> Array:
    numbers, first = [], 0
    for part in parts:
        numbers.append(first + ((part.t - part.t[0]) / LIMITS.block).astype(int))
        first = int(numbers[-1][-1]) + 1
    return np.concatenate([*numbers, *numbers])


def _noise(parts: Sequence[Channels], name: str) -> float:
    """A first guess of a channel's noise: third differences, and the steps of its sensor."""
    values = [getattr(part, name) for part in parts]
    span = max(float(np.ptp(v)) for v in values)
    grain = resolution(*values, quantile=LIMITS.grain)
    return max(noise(values), grain / np.sqrt(12), LIMITS.floor * span + 1e-12)
