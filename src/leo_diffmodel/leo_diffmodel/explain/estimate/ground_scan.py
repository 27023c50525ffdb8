# SPDX-License-Identifier: Apache-2.0
"""Scan the candidates of a robot on the ground, where every rollout is expensive.

A law whose answer is in proportion to its amplitude is run once for each parameter, some windows
stand for all, and what a candidate does is kept from round to round.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
import itertools

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate import trials
from leo_diffmodel.explain.estimate.covariance import leverage_weight
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.scan import Scan, Scanner, stretch_limits, stretched
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices, Candidate
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.sizes import Scales
from leo_diffmodel.explain.settings import Grids
from leo_sim.effects import Parameter


@dataclass(frozen=True)
class Trace:
    """What `points` (S, P) of a candidate take off the whitened residuals, `change` (S, W, N)."""

    points: Array
    change: Array


Traces = dict[Candidate, Trace]


class GroundScanner(Scanner):
    """Scans in some of the training windows; traces of an earlier round are taken over."""

    def __init__(self, problem: Problem, null: Fit, scales: Scales, traces: Traces | None = None):
        some = problem.some_trained(problem.numerics.ground_windows)
        self._share = len(some) / int(problem.train.sum())
        self._kept = {} if traces is None else traces
        super().__init__(problem.take(some), null.take(some), scales)

    def trace(
        self, candidates: Sequence[Candidate], done: Callable[[Candidate], None] = lambda _: None
    ) -> list[Candidate]:
        """Run what no earlier round has; gives those that are known, the others had no time."""
        new, bare = [c for c in candidates if c not in self._kept], copy(self)
        bare._kept = {}  # too much to be sent along
        found = trials.spread_until(self._problem.until, bare._trace, new, done)
        self._kept |= {new[i]: trace for i, trace in found.items()}
        return [c for c in candidates if c in self._kept]

    def scan(self, candidate: Candidate) -> Scan:
        """Amplitudes by least squares where the law is linear, else the best point of a grid."""
        self.trace([candidate])
        trace, count = self._kept[candidate], self.grids.ground_directions
        change = self._project(trace.change)
        search = self._solved if is_straight(candidate) else self._picked
        theta, gain = search(candidate, *turned_to_any(candidate, trace.points, change, count))
        return self._found(candidate, theta, gain, change, trace.points, self._share)

    def _trace(self, candidate: Candidate) -> Trace:
        points = self._straight_grid(candidate) if is_straight(candidate) else self._few(candidate)
        return Trace(points, self._first - self._tried(candidate, points))

    def _straight_grid(self, candidate: Candidate) -> Array:
        numbered, points = [*enumerate(candidate.parameters)], []
        sizes = {i: np.abs(self.sizes(candidate, p)) for i, p in numbered if p.scales}
        amplitude = {i: float(np.sort(size)[1]) for i, size in sizes.items()}
        shapes = [
            two_angles() if p.turns else self.shape(candidate, p)
            for i, p in numbered
            if i not in amplitude
        ]
        for shape in itertools.product(*shapes):
            for i, size in amplitude.items():
                rest, scaled = iter(shape), candidate.parameters[i]
                point = [p.neutral if k in amplitude else next(rest) for k, p in numbered]
                sign = 1.0 if scaled.neutral + size <= scaled.high else -1.0
                point[i] = scaled.neutral + sign * size
                points.append(point)
        return np.array(points)

    def _few(self, candidate: Candidate) -> Array:
        if candidate.effect.hook == 'ground':
            return _grounds(candidate, self.grids)
        points, first = self._grid(candidate), candidate.parameters[0]
        if first.role == 'threshold' and first.neutral > 0:
            points = points[points[:, 0] < first.neutral]  # a higher limit limits nothing
        return points

    def sizes(self, candidate: Candidate, parameter: Parameter) -> Array:
        """Every other amplitude, of an inertia the largest too: the fit finds what is between."""
        sizes = super().sizes(candidate, parameter)
        if is_straight(candidate):
            return sizes
        return sizes[1::2] if candidate.parameters[0].unit == 'kg m2' else sizes[::2]

    def shape(self, candidate: Candidate, parameter: Parameter) -> tuple[float, ...]:
        return super().shape(candidate, parameter)[: self._problem.numerics.most_shapes]

    def _solved(self, candidate: Candidate, points: Array, change: Array) -> tuple[Array, float]:
        """Least squares over the parameters that scale the effect, for the best of its shapes."""
        numerics, scaling = self._problem.numerics, [*amplitude_indices(candidate.parameters)]
        scaled = [candidate.parameters[i] for i in scaling]
        neutral, low, high = np.array([(p.neutral, p.low, p.high) for p in scaled]).T
        best, theta, count = -np.inf, points[0], len(scaling)
        for g, rows in enumerate(change.reshape(-1, count, change.shape[-1])):
            own = points[g * count :][:count]
            step = np.diagonal(own[:, scaling]) - neutral
            weighed = rows * self._leverage(rows)
            gram, slope = weighed @ rows.T, weighed @ self.residual
            scale = np.maximum(np.diag(gram), 1e-12)
            stretch = np.linalg.solve(gram + numerics.ridge * np.diag(scale), slope)
            if candidate.effect.hook == 'sensor':
                most = numerics.farthest_stretch
                stretch = np.clip(stretch, -most, most)
            moved = np.clip(neutral + step * stretch, low, high)
            stretch = (moved - neutral) / step
            gain = float(self._saved(stretch @ rows))
            if gain > best:
                best, theta = gain, own[0].copy()
                theta[scaling] = moved
        return theta, best

    def _picked(self, candidate: Candidate, points: Array, change: Array) -> tuple[Array, float]:
        """The best point of a grid, its amplitude in closed form.

        Of points that save the most in all windows, the one that would save most without a limit.
        """
        weighed = change * np.stack([self._leverage(row[None]) for row in change])
        length2 = np.maximum((weighed * change).sum(-1), 1e-12)
        along = weighed @ self.residual
        low, high = stretch_limits(candidate, self.grids)
        by = self._problem.numerics.between
        stretch = np.clip(along / length2, min(low, 1 / by), max(high, by))
        taken = stretch[:, None] * change
        gains = self._saved(taken)
        alike = gains == gains.max()
        best = int(np.argmax(np.where(alike, self._saved(taken, np.inf), -np.inf)))
        theta = stretched(candidate, points[best], float(stretch[best]))
        return theta, float(gains[best])

    def _leverage(self, rows: Array) -> Array:
        """Squared leverage weight of each sample of the sensitivities (P, M), (M,)."""
        windows = len(self._null.start)
        by_theta = np.moveaxis(rows.reshape(len(rows), windows, -1), 0, -1)
        weight: Array = leverage_weight(self._problem, by_theta)[:, 0] ** 2
        return np.repeat(weight[:, 0], by_theta.shape[1])

    def _saved(self, change: Array, most: float | None = None) -> Array:
        """Nats saved by changes (..., M) of the residual, in no window more than `most`."""
        most = self._problem.numerics.scan_window_nats if most is None else most
        each = self.residual * change - 0.5 * change**2
        windows = len(self._null.start)
        each = each.reshape(*each.shape[:-1], windows, -1).sum(axis=-1)
        return np.clip(each, -most, most).sum(axis=-1)


def scanner_of(problem: Problem, null: Fit, scales: Scales) -> Scanner:
    return (GroundScanner if problem.on_ground else Scanner)(problem, null, scales)


def is_straight(candidate: Candidate) -> bool:
    """Whether the answer is nearly in proportion to the effect's amplitudes."""
    first = candidate.parameters[0]
    return first.role == 'amplitude' and first.linear


def two_angles() -> tuple[float, float]:
    """Where a law that an angle shapes is run: what it does at others follows [rad]."""
    return 0.0, np.pi / 2


def turned_to_any(
    candidate: Candidate, points: Array, change: Array, count: int
) -> tuple[Array, Array]:
    """What an effect does at many angles, from what it does at two of them; see `Parameter`."""
    names = candidate.parameters
    turned = [i for i, p in enumerate(names) if p.turns]
    if not turned or not is_straight(candidate):
        return points, change
    column, angles = turned[0], np.linspace(-np.pi, np.pi, count, endpoint=False)
    second = angles / two_angles()[1]
    weights = np.stack([1 - second, second])
    if names[column].role == 'phase':
        weights = np.stack([np.cos(angles), np.sin(angles)])
    mixed = np.einsum('pa,gpm->gam', weights, change.reshape(-1, 2, change.shape[-1]))
    at = np.repeat(points[::2], count, axis=0)
    at[:, column] = np.tile(angles, len(points) // 2)
    return at, mixed.reshape(len(at), -1)


def _grounds(candidate: Candidate, grids: Grids) -> Array:
    neutral = np.array([p.neutral for p in candidate.parameters])
    if len(neutral) == 1:
        return np.array(grids.frictions)[:, None]
    one = [[k * neutral[0], neutral[1]] for k in grids.ground_factors]
    other = [[neutral[0], d * neutral[1]] for d in grids.ground_factors]
    return np.array(one + other)
