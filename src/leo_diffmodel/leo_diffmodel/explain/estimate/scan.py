# SPDX-License-Identifier: Apache-2.0
"""Scan each effect over finite amplitudes: friction, dead band and delay have no slope at zero."""

from collections.abc import Sequence
from dataclasses import dataclass, field
import itertools
import math

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.covariance import conditional_errors
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices, Candidate, Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.shooting import eliminate
from leo_diffmodel.explain.problem.sizes import Scales
from leo_diffmodel.explain.settings import Grids, Settings
from leo_sim.dynamics.whole_windows import Along
from leo_sim.effects import Parameter


@dataclass(frozen=True)
class Scan:
    candidate: Candidate  # the effect and its place
    theta: Array  # the best parameters, shape (P,)
    gain: float  # on the training windows [nats], nuisances projected out
    evidence: float  # 0.5 |signature|^2 of the largest amplitude [nats]
    first: int  # where in `theta` the candidate's own parameters begin
    # change of the whitened prediction for each point tried, unit length, shape (S, M); what
    # threshold draws and confusability are computed from
    signatures: Array = field(default_factory=lambda: np.zeros((0, 0)))
    # the parameters tried, shape (S, P)
    points: Array = field(default_factory=lambda: np.zeros((0, 0)))
    # 0.5 |signature|^2 of each, shape (S,)
    nats: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def own(self) -> Array:
        return self.theta[self.first : self.first + len(self.candidate.parameters)]


class Scanner:
    """Scans candidates on top of one fitted hypothesis."""

    def __init__(self, problem: Problem, null: Fit, scales: Scales):
        """Linearise at `null` once; a parameter at its bound takes nothing up: no nuisance."""
        self._problem, self._null, self._scales = problem, null, scales
        self.grids = problem.grids
        errors = conditional_errors(null.columns[problem.train])
        linear = problem.linearised(null.hypothesis, null.theta, null.start, errors)
        self._first = linear.residual
        channels, numerics = null.start.shape[-1], problem.numerics
        weight = likelihood.robust_weight(eliminate(linear)[0], channels, numerics, null.typical)
        self._root = np.sqrt(weight)
        self._basis = np.linalg.qr(linear.by_start * self._root[..., None])[0]
        free = null.hypothesis.free(null.theta)
        self._nuisance = self._constants(linear.by_theta[..., free])
        self.residual = self._project(self._first)
        self.first = self.without_starts(self._first)
        self._along = Along()
        self._given = self._moved(null.hypothesis, null.theta)
        self._before = self._project(self._given)

    def scan(self, candidate: Candidate) -> Scan:
        """The best point of the grid; along each ray the closed form picks the amplitude."""
        grid = self._grid(candidate)
        change = self._before - self._project(self._tried(candidate, grid))
        length2 = np.maximum((change**2).sum(-1), 1e-12)
        along = change @ self.residual
        stretch = np.clip(along / length2, *stretch_limits(candidate, self.grids))
        gains = stretch * along - 0.5 * stretch**2 * length2
        best = int(np.argmax(gains))
        theta = stretched(candidate, grid[best], float(stretch[best]))
        return self._found(candidate, theta, float(gains[best]), change, grid)

    def change(self, candidate: Candidate, points: Array) -> Array:
        """What a candidate at points (S, P) near neutral does, start states out, (S, M)."""
        neutral = [p.neutral for p in candidate.parameters]
        e = self._tried(candidate, np.array([neutral, *points]), self._along)
        return self.without_starts(e[0] - e[1:])

    def centre(self, link: str) -> tuple[float, float, float]:
        """The centre of mass of a link in the fit [m]."""
        base, theta = self._problem.base, self._null.theta
        return self._null.hypothesis.model(base, theta).laws.bodies[link].com

    def onsets(self, count: int) -> tuple[float, ...]:
        """When something may begin, s since a run did."""
        longest = self._problem.windows.spans.max()
        return tuple(np.linspace(0.0, longest, count + 2)[1:-1])

    def small(self, candidate: Candidate, begin: Array, direction: Array, size: float) -> float:
        """A size, or less, that changes predictions by no more than where they are straight."""
        change = self.change(candidate, (begin + size * direction)[None])
        most, rms = self._problem.numerics.straight, float(np.sqrt((change**2).mean()))
        return size * min(1.0, most / rms) if 0 < rms < np.inf else size

    def _found(
        self,
        candidate: Candidate,
        theta: Array,
        gain: float,
        change: Array,
        points: Array,
        share: float = 1.0,
    ) -> Scan:
        length2 = np.maximum((change**2).sum(-1), 1e-12)
        unit, nats = change / np.sqrt(length2)[:, None], 0.5 * length2 / share
        full, first = self._null.with_values(theta), self._null.hypothesis.first_constant
        return Scan(candidate, full, gain / share, float(nats.max()), first, unit, points, nats)

    def _tried(self, candidate: Candidate, points: Array, near: bool | Along = False) -> Array:
        thetas = np.stack([self._null.with_values(point) for point in points])
        return self._moved(self._null.hypothesis.with_candidate(candidate), thetas, near)

    def _moved(self, hypothesis: Hypothesis, thetas: Array, near: bool | Along = False) -> Array:
        """Whitened residuals of a hypothesis at some values, (..., W, N)."""
        problem, start = self._problem, self._null.start
        starts = np.broadcast_to(start, (*thetas.shape[:-1], *start.shape))
        return problem.residual(starts, hypothesis.model(problem.rough, thetas), near)

    def _grid(self, candidate: Candidate) -> Array:
        """All points to try, shape (S, parameters of the effect)."""
        parameters = candidate.parameters
        numbered, amplitude = [*enumerate(parameters)], amplitude_indices(parameters)
        rays = [r for r in itertools.product((-1, 0, 1), repeat=len(amplitude)) if any(r)]
        shapes = [self.shape(candidate, p) for i, p in numbered if i not in amplitude]
        sizes = np.stack([self.sizes(candidate, parameters[i]) for i in amplitude], axis=1)
        if _is_linear(candidate):
            sizes = sizes[1:2]
        points = []
        for ray, size, *shape in itertools.product(rays, sizes, *shapes):
            rest, move = iter(shape), dict(zip(amplitude, np.multiply(ray, size), strict=True))
            points.append([p.neutral + move[i] if i in move else next(rest) for i, p in numbered])
        able = [p for p in points if possible(parameters, p)]
        low, high = [p.low for p in parameters], [p.high for p in parameters]
        return np.array(able) if able else np.clip(points, low, high)

    def sizes(self, candidate: Candidate, parameter: Parameter) -> Array:
        """Amplitudes of one sign; the clip and the dead band are sized by the input itself."""
        grids, most = self.grids, self._scales.input
        if candidate.effect.hook == 'sensor' and not parameter.unit:
            return self._scales.of_readings(grids)
        if candidate.effect.hook not in ('command', 'servo') or parameter.role != 'threshold':
            return self._scales.amplitudes(candidate.effect.name, parameter, grids)
        if candidate.effect.hook == 'servo':
            most = self._scales.large(candidate.effect.name, parameter)
            return np.array([f * most - parameter.neutral for f in grids.goal_rates])
        if parameter.neutral > 0:
            return np.array([f * most - parameter.neutral for f in grids.saturations])
        return most * np.array(grids.dead_bands)

    def shape(self, candidate: Candidate, parameter: Parameter) -> tuple[float, ...]:
        if candidate.effect.onset and parameter.unit == 's':
            return self.onsets(len(self.grids.shape_seconds))
        return self._scales.shapes(candidate.effect.name, parameter, self.grids)

    def _constants(self, by_theta: Array) -> Array | None:
        if not by_theta.shape[-1]:
            return None
        rows = by_theta * self._root[..., None]
        rows = rows - self._basis @ (np.swapaxes(self._basis, -1, -2) @ rows)
        flat = rows[self._problem.train].reshape(-1, rows.shape[-1])
        return np.linalg.qr(flat)[0]

    def _project(self, e: Array) -> Array:
        """Weighted residuals of the training windows, nuisances out, shape (..., M)."""
        flat = self.without_starts(e)
        if self._nuisance is None:
            return flat
        return flat - (flat @ self._nuisance) @ self._nuisance.T

    def without_starts(self, e: Array) -> Array:
        """Weighted residuals (..., W, N) of the training windows, start states out, (..., M)."""
        e = (e * self._root)[..., self._problem.train, :]
        basis = self._basis[self._problem.train]
        seen = np.swapaxes(basis, -1, -2) @ e[..., None]
        e = (e[..., None] - basis @ seen)[..., 0]
        return np.asarray(e.reshape(*e.shape[:-2], math.prod(e.shape[-2:])))


def stretched(candidate: Candidate, point: Array, by: float) -> Array:
    parameters = candidate.parameters
    neutral = np.array([p.neutral for p in parameters])
    moved = np.where([p.scales for p in parameters], neutral + by * (point - neutral), point)
    return np.clip(moved, [p.low for p in parameters], [p.high for p in parameters])


def possible(parameters: Sequence[Parameter], point: Sequence[float]) -> bool:
    values = {p.name: v for p, v in zip(parameters, point, strict=True)}
    return all(
        p.low <= values[p.name] <= p.high and values[p.name] >= values.get(p.above, -np.inf)
        for p in parameters
    )


def _is_linear(candidate: Candidate) -> bool:
    return candidate.effect.hook == 'torque' and candidate.parameters[0].linear


def stretch_limits(candidate: Candidate, grids: Grids) -> tuple[float, float]:
    """How far from a grid point the prediction still changes in proportion to the amplitude."""
    if _is_linear(candidate):
        return grids.linear_stretch
    role = candidate.parameters[0].role
    hook = 'command' if candidate.effect.late else candidate.effect.hook
    if hook not in ('command', 'drive', 'servo') or role not in ('threshold', 'delay'):
        return grids.bent_stretch
    return (grids.bent_stretch[0] if role == 'delay' else 1.0), 1.0


def threshold(scans: Sequence[Scan], settings: Settings) -> float:
    """Gain [nats] that a bag of this robot, length and excitation shows without any effect.

    The quantile over draws of white noise of the best gain of all candidates, known in closed form
    along each signature, times a safety factor for noise that is known only roughly.
    """
    gates, at_once = settings.gates, settings.numerics.at_once
    if not scans:
        return gates.least_nats
    columns = np.concatenate([s.signatures for s in scans]).astype(np.float32)
    rng, best = np.random.default_rng(0), []
    for _ in range(settings.numerics.draws // at_once):
        draws = rng.standard_normal((columns.shape[1], at_once)).astype(np.float32)
        best.append(0.5 * np.maximum(columns @ draws, 0.0).max(axis=0) ** 2)
    noise = gates.noise_times * float(np.quantile(best, gates.noise_quantile))
    return max(gates.least_nats, noise)
