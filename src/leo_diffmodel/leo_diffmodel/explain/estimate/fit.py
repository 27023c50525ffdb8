# SPDX-License-Identifier: Apache-2.0
"""Fit a hypothesis on the training windows and score it on the held-out ones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from leo_diffmodel.explain.estimate.covariance import conditional_errors, covariance, gram
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.settle import KEPT, residual_at, settle
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray
ENOUGH_NATS = 0.05
FAR_NATS = 5.0
ENOUGH_SHARE, FAR_SHARE = 3e-4, 1e-3
"""Of the loss: where no hypothesis comes near the noise, the last nats decide nothing."""
SETTLED_NATS, SCALES = 0.5, (1.0, 0.3, 0.1)
OUT_OF_LINE = 2.0
"""Times the median loss: a window on the ground that is worse does not move the parameters."""
RESPONDING, MOST_LEVERAGE = 0.05, 1.5
"""A window on the ground responds to a parameter where its sensitivity is this share of what nine
in ten stay below; one so many times as sensitive as their median is weighed down to that."""
RIDGE, RIDGE_ON_GROUND = 1e-9, 1e-3
"""Of the scaled normal equations; on the ground rollouts are expensive, far steps seldom pay."""
NO_STEP = 1e-12
"""Of a scaled parameter that its bounds hold fast; the solver asks for room."""
PATIENCE = 3
"""Up to this many times the iterations, as long as the last step saved FAR_NATS or more."""


def fit(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Array | None = None,
    start: Array | None = None,
    iterations: int = 8,
    patience: int = PATIENCE,
) -> Fit:
    """Gauss-Newton over parameters and start states, with shorter and shorter steps and bounds.

    Only the training windows move the parameters; every window moves its own start state. Where a
    step does not save what the linearisation promises, it is judged by its loss once the start
    states have settled there: dry friction bends what they do.
    """
    theta = hypothesis.bounded(hypothesis.neutral if theta is None else theta)
    if problem.linearisation and not hypothesis.size:
        start = problem.linearisation.start if start is None else start
        return _read_off(problem, _evaluate(problem, hypothesis, theta, start))
    best = _settled(problem, hypothesis, theta, _first(problem) if start is None else start)
    for number in range(patience * iterations if hypothesis.size else 0):
        best, gained = _stepped(problem, hypothesis, best)
        enough = _enough(problem, best, number >= iterations)
        if gained < enough:
            best, gained = _released(problem, hypothesis, best)
        if gained < enough:
            break
    return _read_off(problem, best)


def _first(problem: Problem) -> Array:
    """The start states to begin with, shape (W, 2J)."""
    return problem.linearisation.start if problem.linearisation else problem.windows.measured[:, 0]


def _enough(problem: Problem, best: _Point, late: bool) -> float:
    """What a step must save to be followed by another [nats]."""
    if problem.linearisation:
        return float('inf') if late else SETTLED_NATS
    least, share = (FAR_NATS, FAR_SHARE) if late else (ENOUGH_NATS, ENOUGH_SHARE)
    return max(least, share * float(shooting.huber(best.linear.residual[problem.train]).sum()))


def read_at(problem: Problem, fitted: Fit) -> Fit:
    """A fit as it is in another weighting of the residuals, its values and their errors kept."""
    errors = conditional_errors(fitted.columns)
    begin = _evaluate if problem.linearisation else _settled
    point = begin(problem, fitted.hypothesis, fitted.theta, fitted.start, errors)
    return replace(_read_off(problem, point), theta=fitted.theta, covariance=fitted.covariance)


def settled_as(problem: Problem, fitted: Fit, other: Fit) -> Fit:
    """The fit with the start states of another one in the windows where they suit it better.

    A contact may settle in two ways; what another hypothesis gains by that alone is no gain.
    """
    fixed = problem.fixed(fitted.hypothesis, fitted.theta)
    point = _evaluate(fixed, Hypothesis(), np.zeros(0), other.start)
    loss = shooting.huber(point.linear.residual)
    better = loss < fitted.loss
    return replace(
        fitted,
        start=np.where(better[:, None], other.start, fitted.start),
        loss=np.minimum(loss, fitted.loss),
        residual=np.where(better[:, None], point.rest, fitted.residual),
    )


def _stepped(
    problem: Problem, hypothesis: Hypothesis, best: _Point
) -> tuple[_Point, float]:
    """The first shorter and shorter step that lowers the loss, and by how much [nats].

    A window on the ground far worse than most has a contact that settles otherwise than the
    robot's; it has no say in where to go.
    """
    loss = shooting.huber(best.linear.residual)
    most, step = _in_line(problem, loss), _sound_step(problem, best)

    def saved(there: Array) -> float:
        left = np.minimum(there, most)
        return float((np.minimum(loss, most) - left)[problem.train].sum())

    for scale in SCALES:
        theta, start = _along(hypothesis, best.theta, best.start, step, scale)
        fixed = problem.fixed(hypothesis, theta)
        gained = saved(shooting.huber(residual_at(fixed, start)))
        if gained < KEPT * saved(shooting.huber(_ahead(best, theta, start))):
            starts = start, best.start
            start, there = settle(problem, hypothesis, theta, starts, best.linear.by_start)
            gained = saved(there)
        if gained > 0:
            return _evaluate(problem, hypothesis, theta, start, best.errors(problem)), gained
    return best, 0.0


def _ahead(best: _Point, theta: Array, start: Array) -> Array:
    """The residual that the linearisation at one point promises at another one, (W, N)."""
    linear = best.linear
    moved = (linear.by_start @ (start - best.start)[..., None])[..., 0]
    return linear.residual + moved + linear.by_theta @ (theta - best.theta)


def looked_at(problem: Problem, hypothesis: Hypothesis, theta: Array) -> tuple[Fit, Step]:
    """A hypothesis on the ground as it is at some values, and the Gauss-Newton step from there."""
    assert problem.linearisation
    point = _evaluate(problem, hypothesis, hypothesis.bounded(theta), problem.linearisation.start)
    return _read_off(problem, point), _sound_step(problem, point)


def moved(fitted: Fit, step: Step, scale: float) -> Fit:
    """Where so much of a step leads; the rest of the fit is that of before."""
    theta, start = _along(fitted.hypothesis, fitted.theta, fitted.start, step, scale)
    return replace(fitted, theta=theta, start=np.where(np.isfinite(start), start, fitted.start))


def _along(
    hypothesis: Hypothesis, theta: Array, start: Array, step: Step, scale: float
) -> tuple[Array, Array]:
    """Parameters and start states after so much of a step; the starts answer to what is linear."""
    straight = hypothesis.bounded(theta + scale * step.theta) - theta
    moved = hypothesis.moved(theta, scale * step.theta)
    return moved, start + (step.start + step.gain @ straight)


def _in_line(problem: Problem, loss: Array) -> float:
    """The most that a window may lose to have a say [nats]."""
    if not problem.linearisation:
        return float('inf')
    return OUT_OF_LINE * float(np.median(loss[problem.train]))


def _sound_step(problem: Problem, point: _Point) -> Step:
    loss = shooting.huber(point.linear.residual)
    return _step(problem, point, problem.train & (loss < _in_line(problem, loss)))


def _settled(
    problem: Problem, hypothesis: Hypothesis, theta: Array, start: Array,
    errors: Array | None = None,
) -> _Point:
    """The point where the starts have settled."""
    settled, _ = settle(problem, hypothesis, theta, (start,))
    return _evaluate(problem, hypothesis, theta, settled, errors)


def _released(
    problem: Problem, hypothesis: Hypothesis, best: _Point
) -> tuple[_Point, float]:
    """The point with the starts that settle better from where they were measured, and its gain.

    A joint that friction holds does not answer to its start, which may be caught there. Contacts
    have settled before.
    """
    if problem.linearisation:
        return best, 0.0
    starts, theta = (best.start, problem.windows.measured[:, 0]), best.theta
    start, loss = settle(problem, hypothesis, theta, starts, best.linear.by_start)
    saved = float((shooting.huber(best.linear.residual) - loss)[problem.train].sum())
    if saved <= 0:
        return best, 0.0
    return _evaluate(problem, hypothesis, theta, start, best.errors(problem)), saved


@dataclass(frozen=True)
class _Point:
    """A hypothesis at some values; `rest` and `slope` have the start states projected out."""

    hypothesis: Hypothesis
    theta: Array
    start: Array
    linear: shooting.Linear
    rest: Array
    slope: Array

    def errors(self, problem: Problem) -> Array:
        """Standard error of each parameter with the others fixed, (P,); inf where none shows."""
        return conditional_errors(self.slope[problem.train])


@dataclass(frozen=True)
class Step:
    """The step of the parameters, and of each start state: start + gain (change of theta)."""

    theta: Array
    start: Array
    gain: Array


def _evaluate(
    problem: Problem, hypothesis: Hypothesis, theta: Array, start: Array,
    errors: Array | None = None,
) -> _Point:
    linear = shooting.linearise(problem.base, problem.windows, problem.weight, hypothesis, theta,
                                start, problem.by_start, errors)  # fmt: skip
    rest, slope = shooting.eliminate(linear)[:2]
    return _Point(hypothesis, theta, start, linear, rest, slope)


def _step(problem: Problem, point: _Point, chosen: Array | None = None) -> Step:
    """The next step; parameters by the training windows, or those `chosen` (W,)."""
    chosen = problem.train if chosen is None else chosen
    weight = shooting.robust_weight(point.rest)
    residual, by_theta, start, gain = shooting.eliminate(point.linear, weight)
    step = np.zeros(len(point.theta))
    if len(step):
        leverage = leverage_weight(problem, by_theta[chosen])
        columns = by_theta[chosen] * leverage
        slope = np.einsum('wnp,wn->p', columns, residual[chosen] * leverage[..., 0])
        ridge = RIDGE_ON_GROUND if problem.linearisation else RIDGE
        step = _bounded_step(gram(columns), slope, point, ridge)
    return Step(step, -start, -gain)


def _bounded_step(matrix: Array, slope: Array, point: _Point, ridge: float) -> Array:
    """The Gauss-Newton step that is best within the bounds; where one is met, the rest makes do.

    Scaled, as the ridge is: two parameters that do the same thing share what they do.
    """
    step, moves = np.zeros(len(slope)), np.diag(matrix) > 0
    if not moves.any():
        return step
    low = (point.hypothesis.least(point.theta) - point.theta)[moves]
    high = (point.hypothesis.high - point.theta)[moves]
    scale = np.sqrt(np.diag(matrix)[moves])
    damped = matrix[np.ix_(moves, moves)] / np.outer(scale, scale) + ridge * np.eye(len(scale))
    root = np.linalg.cholesky(damped).T
    most = np.maximum(scale * high, scale * low + NO_STEP)
    target = -solve_triangular(root, slope[moves] / scale, trans=1)
    step[moves] = lsq_linear(root, target, (scale * low, most), 'bvls').x / scale
    return step


def _read_off(problem: Problem, point: _Point) -> Fit:
    """Loss, residual and covariance of a point."""
    columns = point.slope * leverage_weight(problem, point.slope)
    train = problem.train
    block = np.arange(len(train)) if problem.block is None else problem.block
    free = point.hypothesis.free(point.theta)
    spread = shooting.dispersion(point.rest[train], point.start.shape[-1])
    return Fit(
        point.hypothesis,
        point.theta,
        covariance(columns[train], point.rest[train], block[train], free, spread),
        point.start,
        shooting.huber(point.linear.residual),
        point.rest,
        columns,
    )


def leverage_weight(problem: Problem, by_theta: Array) -> Array:
    """Weight of each window that limits its leverage on the parameters (Mallows), (W, 1, 1).

    A contact that comes or goes with a small change of a parameter makes a window many times as
    sensitive to it as it is to a larger change.
    """
    if not problem.linearisation or not by_theta.size:
        return np.ones((len(by_theta), 1, 1))
    size = np.sqrt((by_theta**2).sum(axis=1))
    responding = size >= RESPONDING * np.quantile(size, 0.9, axis=0)
    typical = [np.median(s[a]) for s, a in zip(size.T, responding.T, strict=True)]
    most = MOST_LEVERAGE * np.array(typical)
    return np.where(size > most, most / np.maximum(size, 1e-12), 1.0).min(axis=1)[:, None, None]
