# SPDX-License-Identifier: Apache-2.0
"""Scan each effect over finite amplitudes: friction, dead band and delay have no slope at zero."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import itertools

import numpy as np

from leo_diffmodel.compare.sizes import (
    COUNTS,
    EARTH,
    force_scale,
    inertia_scale,
    mass_scale,
    reach,
    torque_scale,
    UnitSizes,
)
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.estimate.covariance import conditional_errors
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices, Candidate, Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import Grids
from leo_sim.description.robot import Robot
from leo_sim.effects import Parameter
from leo_sim.model import Model

Array = np.ndarray


@dataclass(frozen=True)
class Scales(UnitSizes):
    """What is large on this robot and in this data.

    The largest torque of a motor, or else of gravity; rms rates; the largest angle, 1 or more; the
    way and the rms speed of slides, or else the robot's reach; three times the largest inertia and
    mass of a link; the weight of such a mass, or the largest force of a motor on a slide; the
    largest input.
    """

    def amplitudes(self, effect: str, parameter: Parameter, grids: Grids) -> Array:
        """Amplitudes of one sign to try, small to large, as change from neutral."""
        if parameter.role == 'delay':
            return np.array(grids.delays)
        if parameter.unit == 'rad':
            return np.array(grids.angles)
        return self.large(effect, parameter) * np.array(grids.fractions)

    def shapes(self, effect: str, parameter: Parameter, grids: Grids) -> tuple[float, ...]:
        """Values to try of a parameter that shapes an effect without scaling it."""
        if parameter.turns:
            way = 1.0 if parameter.unit == 'rad' else self.length / np.pi
            return tuple(way * angle for angle in grids.directions)
        if parameter.unit == 's':
            return grids.shape_seconds
        if parameter.unit in COUNTS:
            return tuple(float(n) for n in range(1, grids.most_periods + 1))
        return tuple(self.large(effect, parameter) * share for share in grids.shape_shares)


@dataclass(frozen=True)
class Scan:
    """What a scan of one candidate found.

    Attributes:
        candidate: the effect and its place.
        theta: the best parameters, shape (P,).
        gain: on the training windows [nats], nuisances projected out.
        signatures: change of the whitened prediction for each point tried, unit length,
            shape (S, M); what threshold draws and confusability are computed from.
        evidence: 0.5 |signature|^2 of the largest amplitude [nats].
        points: the parameters tried, shape (S, P).
        nats: 0.5 |signature|^2 of each, shape (S,).
        first: where in `theta` the candidate's own parameters begin.
        others: where else a fit may begin, best first: the best points of other whole numbers,
            which no fit moves (periods of a ripple in a turn), (N, P of the candidate).
    """

    candidate: Candidate
    theta: Array
    gain: float
    signatures: Array
    evidence: float
    points: Array
    nats: Array
    first: int = 0
    others: tuple[Array, ...] = ()

    @property
    def own(self) -> Array:
        """The best values of the candidate itself, shape (P,)."""
        return self.theta[self.first : self.first + len(self.candidate.parameters)]

    def stretched(self, index: int, by: float) -> Array:
        """A point of the grid with its amplitudes times a factor, within the bounds."""
        return stretched(self.candidate, self.points[index], by)


class Scanner:
    """Scans candidates on top of one fitted hypothesis."""

    def __init__(self, problem: Problem, null: Fit, scales: Scales):
        """Linearise at `null` once; every candidate reuses it.

        A parameter at its bound can take nothing up, so it is no nuisance.
        """
        self._problem, self._null, self._scales = problem, null, scales
        self._linear = linear = problem.linearised(
            null.hypothesis,
            null.theta,
            null.start,
            conditional_errors(null.columns[problem.train]),
        )
        rest, _, _, _ = shooting.eliminate(linear)
        weight = shooting.robust_weight(rest, null.start.shape[-1], problem.numerics, null.typical)
        self._root = np.sqrt(weight)
        self._basis = np.linalg.qr(linear.by_start * self._root[..., None])[0]
        free = null.hypothesis.free(null.theta)
        self._nuisance = self._constants(linear.by_theta[..., free])
        self.residual = self._project(linear.residual)
        self._before = self._project(self._moved(null.hypothesis, null.theta))

    def scan(self, candidate: Candidate) -> Scan:
        """The best point of the grid; along each ray the closed form picks the amplitude."""
        grid = self._grid(candidate)
        hypothesis = self._null.hypothesis.with_candidate(candidate)
        thetas = self._thetas(hypothesis, candidate, grid)
        change = self._before - self._project(self._moved(hypothesis, thetas))
        length2 = np.maximum((change**2).sum(-1), 1e-12)
        along = change @ self.residual
        stretch = np.clip(along / length2, *stretch_limits(candidate, self._problem.grids))
        gains = stretch * along - 0.5 * stretch**2 * length2
        best = int(np.argmax(gains))
        theta = stretched(candidate, grid[best], float(stretch[best]))
        full = np.concatenate([self._null.theta[: self._split], theta, self._tail])
        unit = change / np.sqrt(length2)[:, None]
        nats = 0.5 * length2
        others = [
            stretched(candidate, grid[i], float(stretch[i]))
            for i in _other_wholes(candidate, grid, gains)
        ]
        return Scan(
            candidate,
            full,
            float(gains[best]),
            unit,
            float(nats.max()),
            grid,
            nats,
            self._split,
            tuple(others),
        )

    def _moved(self, hypothesis: Hypothesis, thetas: Array) -> Array:
        """Whitened residuals of a hypothesis at some values, (..., W, N)."""
        problem, start = self._problem, self._null.start
        starts = np.broadcast_to(start, (*thetas.shape[:-1], *start.shape))
        model = hypothesis.model(problem.rough, thetas) if thetas.shape[-1] else problem.rough
        predicted = shooting.predict(model, problem.windows, starts)
        return shooting.whiten(
            problem.windows, predicted, problem.sigma, problem.numerics.farthest
        )

    @property
    def _split(self) -> int:
        return self._null.hypothesis.size - len(self._null.hypothesis.constants)

    @property
    def _tail(self) -> Array:
        return self._null.theta[self._split :]

    def _thetas(self, hypothesis: Hypothesis, candidate: Candidate, grid: Array) -> Array:
        thetas = np.empty((len(grid), hypothesis.size))
        first, count = self._split, len(candidate.parameters)
        thetas[:, :first] = self._null.theta[:first]
        thetas[:, first : first + count] = grid
        thetas[:, first + count :] = self._tail
        return thetas

    def _grid(self, candidate: Candidate) -> Array:
        """All points to try, shape (S, parameters of the effect)."""
        parameters = candidate.parameters
        amplitude = amplitude_indices(parameters)
        rays = [r for r in itertools.product((-1, 0, 1), repeat=len(amplitude)) if any(r)]
        shapes = [
            self._shape(candidate, p) for i, p in enumerate(parameters) if i not in amplitude
        ]
        sizes = np.stack([self._sizes(candidate, parameters[i]) for i in amplitude], axis=1)
        if _is_linear(candidate):
            sizes = sizes[1:2]
        points = []
        for ray, size, *shape in itertools.product(rays, sizes, *shapes):
            rest = iter(shape)
            moves = dict(zip(amplitude, np.multiply(ray, size), strict=True))
            points.append(
                [
                    p.neutral + moves[i] if i in moves else next(rest)
                    for i, p in enumerate(parameters)
                ]
            )
        possible = [p for p in points if _possible(parameters, p)]
        return np.array(possible or [_inside(parameters, p) for p in points])

    def _sizes(self, candidate: Candidate, parameter: Parameter) -> Array:
        """Amplitudes of one sign; the clip and the dead band are sized by the input itself."""
        grids, most = self._problem.grids, self._scales.input
        if candidate.effect.hook != 'command' or parameter.role != 'threshold':
            return self._scales.amplitudes(candidate.effect.name, parameter, grids)
        if parameter.neutral > 0:
            return np.array([f * most - parameter.neutral for f in grids.saturations])
        return most * np.array(grids.dead_bands)

    def _shape(self, candidate: Candidate, parameter: Parameter) -> tuple[float, ...]:
        return self._scales.shapes(candidate.effect.name, parameter, self._problem.grids)

    def _constants(self, by_theta: Array) -> Array | None:
        if not by_theta.shape[-1]:
            return None
        rows = by_theta * self._root[..., None]
        rows = rows - self._basis @ (np.swapaxes(self._basis, -1, -2) @ rows)
        flat = rows[self._problem.train].reshape(-1, rows.shape[-1])
        return np.linalg.qr(flat)[0]

    def _project(self, e: Array) -> Array:
        """Weighted residuals of the training windows, nuisances out, shape (..., M)."""
        e = (e * self._root)[..., self._problem.train, :]
        basis = self._basis[self._problem.train]
        seen = np.swapaxes(basis, -1, -2) @ e[..., None]
        e = (e[..., None] - basis @ seen)[..., 0]
        flat = e.reshape(*e.shape[:-2], -1)
        if self._nuisance is None:
            return flat
        return flat - (flat @ self._nuisance) @ self._nuisance.T


def _other_wholes(candidate: Candidate, grid: Array, gains: Array) -> list[int]:
    """The best points of the grid at all whole numbers of a parameter but the best, best first."""
    whole = [i for i, p in enumerate(candidate.parameters) if p.whole]
    if not whole:
        return []
    found: dict[tuple[float, ...], int] = {}
    for point in np.argsort(gains)[::-1]:
        found.setdefault(tuple(grid[point, whole]), int(point))
    return list(found.values())[1:]


def stretched(candidate: Candidate, point: Array, by: float) -> Array:
    """A point with the amplitudes of an effect times a factor, within its bounds."""
    parameters = candidate.parameters
    neutral = np.array([p.neutral for p in parameters])
    scaled = [i in amplitude_indices(parameters) for i in range(len(parameters))]
    moved = np.where(scaled, neutral + by * (point - neutral), point)
    return np.clip(moved, [p.low for p in parameters], [p.high for p in parameters])


def _possible(parameters: Sequence[Parameter], point: Sequence[float]) -> bool:
    """Whether the values are within the bounds, those that depend on another one too."""
    values = {p.name: v for p, v in zip(parameters, point, strict=True)}
    return all(
        p.low <= values[p.name] <= p.high and values[p.name] >= values.get(p.above, -np.inf)
        for p in parameters
    )


def _inside(parameters: Sequence[Parameter], point: Sequence[float]) -> list[float]:
    """The point nearest to this one within the bounds."""
    return [min(max(v, p.low), p.high) for p, v in zip(parameters, point, strict=True)]


def _is_linear(candidate: Candidate) -> bool:
    """Whether the law is linear in its amplitude: one point then gives the whole ray."""
    return candidate.effect.hook == 'torque' and candidate.parameters[0].linear


def stretch_limits(candidate: Candidate, grids: Grids) -> tuple[float, float]:
    """How far from a grid point the prediction still changes in proportion to the amplitude."""
    if _is_linear(candidate):
        return grids.linear_stretch
    hook = 'command' if candidate.effect.late else candidate.effect.hook
    bent = candidate.parameters[0].role in ('threshold', 'delay')
    return (1.0, 1.0) if bent and hook in ('command', 'drive') else grids.bent_stretch


def scales_of(model: Model, windows: Windows) -> Scales:
    """Sizes of this robot and this data, for choosing amplitudes."""
    robot = model.robot
    states = model.laws.true_state(windows.q[:, :-1], windows.dq[:, :-1])
    applied = model.laws.at_motors(windows.inputs, *states)
    mass, rate = 3 * mass_scale(robot), max(float(np.sqrt((windows.dq**2).mean())), 1e-3)
    length, speed = _sliding(robot, windows) or (reach(robot), reach(robot) * rate)
    return Scales(
        torque=torque_scale(robot),
        rate=rate,
        angle=max(float(np.abs(windows.q).max(initial=0.0)), 1.0),
        force=max(EARTH * mass, force_scale(robot)),
        speed=speed,
        length=length,
        inertia=3 * inertia_scale(robot),
        mass=mass,
        input=max(float(np.abs(applied).max(initial=0.0)), 1e-9),
    )


def _sliding(robot: Robot, windows: Windows) -> tuple[float, float] | None:
    """The farthest position [m] and the rms speed [m/s] of slides; None without, but a base's."""
    slides = [
        i
        for i, name in enumerate(robot.joint_names)
        if name in robot.slides.difference(robot.base_joints)
    ]
    if not slides:
        return None
    way = float(np.abs(windows.q[..., slides]).max(initial=0.0))
    return max(way, 1e-3), max(float(np.sqrt((windows.dq[..., slides] ** 2).mean())), 1e-3)
