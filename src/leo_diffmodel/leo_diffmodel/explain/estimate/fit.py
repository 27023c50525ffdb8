# SPDX-License-Identifier: Apache-2.0
"""Fit a hypothesis on the training windows and score it on the held-out ones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from leo_diffmodel.explain.estimate.covariance import conditional_errors, covariance, gram
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.settle import residual_at, settle
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import Numerics

Array = np.ndarray


def fit(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Array | None = None,
    start: Array | None = None,
    iterations: int | None = None,
    thorough: bool = False,
) -> Fit:
    """Levenberg-Marquardt over the parameters within bounds, the start states projected out.

    Only the training windows move the parameters; every window has the start state that suits it
    best (variable projection, Golub and Pereyra 1973). What a step saves of what it promises sets
    the damping of the next one; the fit ends where no step promises anything.

    Args:
        problem: the windows.
        hypothesis: what is free.
        theta: values to begin with, shape (P,); None begins with what changes nothing.
        start: start states to begin with, shape (W, 2J); None begins with those measured.
        iterations: most steps; None for those of the settings.
        thorough: every step tries the measured start states as well, not the first and last only.
    """
    theta = hypothesis.bounded(hypothesis.neutral if theta is None else theta)
    at = _point(problem, hypothesis, theta, _settled(problem, hypothesis, theta, start))
    damping, settled, ended = problem.numerics.damping, True, not hypothesis.size
    most = problem.numerics.iterations if iterations is None else iterations
    for _ in range(most if hypothesis.size else 0):
        if problem.late():
            break
        there, damping = _advanced(problem, at, damping, thorough)
        ended = there is None and settled
        if ended:
            break
        settled = there is None
        at = there or _point(
            problem,
            hypothesis,
            at.theta,
            _settled(problem, hypothesis, at.theta, at.start),
            at.errors,
        )
    return replace(_read_off(problem, at), ended=ended)


def read_at(problem: Problem, fitted: Fit) -> Fit:
    """A fit as it is in another weighting of the residuals, its values and their errors kept."""
    told = replace(problem, typical=fitted.typical)
    settled = _settled(told, fitted.hypothesis, fitted.theta, fitted.start)
    point = _point(
        problem,
        fitted.hypothesis,
        fitted.theta,
        settled,
        conditional_errors(fitted.columns[problem.train]),
    )
    return replace(
        _read_off(problem, point),
        theta=fitted.theta,
        covariance=fitted.covariance,
        certificate=fitted.certificate,
    )


def settled_as(problem: Problem, fitted: Fit, other: Fit) -> Fit:
    """The fit with the start states of another one in the windows where they suit it better.

    A contact may settle in two ways; what another hypothesis gains by that alone is no gain.
    """
    fixed = problem.fixed(fitted.hypothesis, fitted.theta)
    linear = fixed.linearised(Hypothesis(), np.zeros(0), other.start)
    channels = other.start.shape[-1]
    loss = shooting.loss(linear.residual, channels, fixed.numerics, fitted.typical)
    rest = shooting.eliminate(linear)[0]
    better = loss < fitted.loss
    return replace(
        fitted,
        start=np.where(better[:, None], other.start, fitted.start),
        loss=np.minimum(loss, fitted.loss),
        residual=np.where(better[:, None], rest, fitted.residual),
    )


def looked_at(problem: Problem, hypothesis: Hypothesis, theta: Array) -> tuple[Fit, Step]:
    """A hypothesis on the ground as it is at some values, and the Gauss-Newton step from there."""
    assert problem.linearisation
    theta, start = hypothesis.bounded(theta), problem.linearisation.start
    point = _point(problem, hypothesis, theta, start)
    return _read_off(problem, point), point.step(problem.numerics.damping)


def moved(fitted: Fit, step: Step, scale: float) -> Fit:
    """Where so much of a step leads; the rest of the fit is that of before."""
    theta, start = _along(fitted.hypothesis, fitted.theta, fitted.start, step, scale)
    return replace(fitted, theta=theta, start=np.where(np.isfinite(start), start, fitted.start))


def _advanced(
    problem: Problem, at: _Point, damping: float, thorough: bool
) -> tuple[_Point | None, float]:
    """The first step, shorter and shorter, that saves something, and the damping of the next.

    None where no step promises anything. The start states follow as the linearisation says; where
    that saves less than half of the promise they are settled.
    """
    numerics, harder = problem.numerics, problem.numerics.harder
    while (step := at.step(damping)).promised > problem.numerics.step_nats:
        theta, start = _along(at.hypothesis, at.theta, at.start, step)
        residual = residual_at(problem.fixed(at.hypothesis, theta), start)
        saved = at.saved(residual)
        if saved < numerics.kept * step.promised:
            begins = problem.begins(start) if thorough else (start,)
            settled = settle(at.told(problem), at.hypothesis, theta, begins, at.linear.by_start)
            start, saved = settled.start, at.saved(settled.residual)
        if saved > 0:
            softer = max(numerics.softest, 1.0 - (2.0 * saved / step.promised - 1.0) ** 3)
            return (
                _point(problem, at.hypothesis, theta, start, at.errors),
                max(damping * softer, numerics.least_damping),
            )
        damping, harder = max(damping, 1e3 * numerics.least_damping) * harder, 2.0 * harder
    return None, damping


def _along(
    hypothesis: Hypothesis, theta: Array, start: Array, step: Step, scale: float = 1.0
) -> tuple[Array, Array]:
    """Parameters and start states after so much of a step; the starts answer to what is linear."""
    straight = hypothesis.bounded(theta + scale * step.theta) - theta
    moved = hypothesis.moved(theta, scale * step.theta)
    return moved, start + (step.start + step.gain @ straight)


def _settled(problem: Problem, hypothesis: Hypothesis, theta: Array, start: Array | None) -> Array:
    """The windows settled from some start states, or from the first there are."""
    start = problem.first if start is None else start
    return settle(problem, hypothesis, theta, problem.begins(start)).start


def _point(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Array,
    start: Array,
    errors: Array | None = None,
) -> _Point:
    linear = problem.linearised(hypothesis, theta, start, errors)
    return _Point.of(problem, hypothesis, theta, start, linear)


@dataclass(frozen=True)
class Step:
    """The step of the parameters, and of each start state: start + gain (change of theta).

    Attributes:
        theta: shape (P,).
        start, gain: shapes (W, 2J) and (W, 2J, P).
        promised: what it saves where all is linear [nats].
    """

    theta: Array
    start: Array
    gain: Array
    promised: float = 0.0


@dataclass(frozen=True)
class _Point:
    """A hypothesis at some values, linearised there.

    Attributes:
        rest, slope: residual and sensitivity with the start states projected out.
        typical: size of what it is off by in most windows, (1, 2J); see `Problem.typical_of`.
        loss: of each window [nats], shape (W,).
        most: that a window may lose to have a say [nats].
        enough: that a step must promise to be tried [nats].
        matrix, descent: of the robust normal equations of the windows that have one.
    """

    hypothesis: Hypothesis
    theta: Array
    start: Array
    linear: shooting.Linear
    numerics: Numerics
    rest: Array
    slope: Array
    train: Array
    typical: Array | None
    loss: Array
    most: float
    matrix: Array
    descent: Array
    answer: tuple[Array, Array]

    @classmethod
    def of(
        cls,
        problem: Problem,
        hypothesis: Hypothesis,
        theta: Array,
        start: Array,
        linear: shooting.Linear,
    ) -> _Point:
        """Project the start states out and sum over the windows that are in line."""
        rest, slope = shooting.eliminate(linear)[:2]
        channels, numerics = start.shape[-1], problem.numerics
        typical = problem.typical_of(linear.residual)
        loss = shooting.loss(linear.residual, channels, numerics, typical)
        most = numerics.moving * max(float(np.median(loss[problem.train])), 1e-12)
        weight = shooting.robust_weight(linear.residual, channels, numerics, typical)
        residual, columns, solved, gain = shooting.eliminate(linear, weight)
        chosen = problem.train & (loss < most)
        leverage = leverage_weight(problem, columns[chosen])
        columns = columns[chosen] * leverage
        descent = -np.einsum('wnp,wn->p', columns, residual[chosen] * leverage[..., 0])
        return cls(
            hypothesis,
            theta,
            start,
            linear,
            numerics,
            rest,
            slope,
            problem.train,
            typical,
            loss,
            most,
            gram(columns),
            descent,
            (-solved, -gain),
        )

    @property
    def errors(self) -> Array:
        """Standard error of each parameter with the others fixed, (P,); inf where none shows."""
        return conditional_errors(self.slope[self.train])

    def told(self, problem: Problem) -> Problem:
        """The problem with the size of what the hypothesis is off by."""
        return replace(problem, typical=self.typical)

    def saved(self, residual: Array) -> float:
        """What another residual (W, N) saves of mine, no window out of line [nats]."""
        channels = self.start.shape[-1]
        typical, numerics = self.typical, self.numerics
        if typical is not None:
            typical = shooting.typical_size(residual[self.train], channels, numerics)
        loss = shooting.loss(residual, channels, numerics, typical)
        return float(
            (np.minimum(self.loss, self.most) - np.minimum(loss, self.most))[self.train].sum()
        )

    def step(self, damping: float) -> Step:
        """The damped Gauss-Newton step that is best within the bounds."""
        theta = _bounded_step(self, damping)
        promised = float(self.descent @ theta - 0.5 * theta @ self.matrix @ theta)
        return Step(theta, *self.answer, promised)


def _bounded_step(point: _Point, damping: float) -> Array:
    """The damped step that is best within the bounds; where one is met, the rest makes do.

    Scaled, as the damping is: two parameters that do the same thing share what they do.
    """
    matrix = point.matrix
    step, moves = np.zeros(len(matrix)), np.diag(matrix) > 0
    if not moves.any():
        return step
    low = (point.hypothesis.least(point.theta) - point.theta)[moves]
    high = (point.hypothesis.high - point.theta)[moves]
    scale = np.sqrt(np.diag(matrix)[moves])
    damped = matrix[np.ix_(moves, moves)] / np.outer(scale, scale) + damping * np.eye(len(scale))
    root = np.linalg.cholesky(damped).T
    most = np.maximum(scale * high, scale * low + point.numerics.no_step)
    target = solve_triangular(root, point.descent[moves] / scale, trans=1)
    step[moves] = lsq_linear(root, target, (scale * low, most), 'bvls').x / scale
    return step


def _read_off(problem: Problem, point: _Point) -> Fit:
    """Loss, residual and covariance of a point."""
    columns = point.slope * leverage_weight(problem, point.slope)
    train = problem.train
    block = np.arange(len(train)) if problem.block is None else problem.block
    free = point.hypothesis.free(point.theta)
    channels = point.start.shape[-1]
    spread = shooting.dispersion(point.rest[train], channels)
    return Fit(
        point.hypothesis,
        point.theta,
        covariance(
            columns[train],
            point.rest[train],
            block[train],
            free,
            spread,
            channels,
            problem.numerics,
            point.typical,
        ),
        point.start,
        point.loss,
        point.rest,
        columns,
        point.step(problem.numerics.least_damping).promised,
        point.typical,
    )


def leverage_weight(problem: Problem, by_theta: Array) -> Array:
    """Weight of each window that limits its leverage on the parameters (Mallows), (W, 1, 1).

    A contact that comes or goes with a small change of a parameter makes a window many times as
    sensitive to it as it is to a larger change.
    """
    numerics = problem.numerics
    if not np.isfinite(numerics.most_leverage) or not by_theta.size:
        return np.ones((len(by_theta), 1, 1))
    size = np.sqrt((by_theta**2).sum(axis=1))
    responding = size >= numerics.responding * np.quantile(size, 0.9, axis=0)
    typical = [np.median(s[a]) for s, a in zip(size.T, responding.T, strict=True)]
    most = numerics.most_leverage * np.array(typical)
    return np.where(size > most, most / np.maximum(size, 1e-12), 1.0).min(axis=1)[:, None, None]
