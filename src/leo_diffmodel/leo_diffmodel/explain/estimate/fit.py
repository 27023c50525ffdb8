# SPDX-License-Identifier: Apache-2.0
"""Fit a hypothesis on the training windows and score it on the held-out ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear
from scipy.special import stdtrit

from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.estimate import shooting
from leo_diffmodel.explain.estimate.footing import Footing
from leo_diffmodel.explain.estimate.hypothesis import Hypothesis
from leo_sim.model import Model

Array = np.ndarray
ENOUGH_NATS = 0.05
FAR_NATS = 5.0
ENOUGH_SHARE, FAR_SHARE = 3e-4, 1e-3
"""Of the loss: where no hypothesis comes near the noise, the last nats decide nothing."""
FOOTED_NATS, SCALES = 0.5, (1.0, 0.3, 0.1)
KEPT = 0.5
"""Of what the linearisation promises of a step; less, and the start states settle first."""
ROUNDS, SETTLED_SHARE = 4, 1e-3
"""In which start states settle after a step at most; and what a round must save of the loss."""
OUT_OF_LINE = 2.0
"""Times the median loss: a window on the ground that is worse does not move the parameters."""
ANSWERS, LOUD = 0.05, 1.5
"""Windows on the ground answer with this share of what nine in ten stay below; one that answers so
many times as strongly as the median of them has its answer cut to that."""
RIDGE, RIDGE_ON_GROUND = 1e-9, 1e-3
"""Of the scaled normal equations; rollouts on the ground are dear, and far steps seldom pay."""
NO_STEP = 1e-12
"""Of a scaled parameter that its bounds hold fast; the solver asks for room."""
MEDIAN_CHI2 = 0.455
"""Median of the square of a standard normal variable."""
PATIENCE = 3
"""Up to this many times the iterations, as long as the last step saved FAR_NATS or more."""


@dataclass(frozen=True)
class Problem:
    """What every hypothesis is judged on.

    Attributes:
        base: the model as it stands.
        windows: the data, training and held-out.
        sigma: noise of each recording and channel (angles, then rates), shape (R, 2J).
        train: which windows a fit may see, shape (W,).
        footing: of a robot on the ground, the settled start states and what they do.
        block: stretch of time each window lies in, shape (W,): within one, errors are alike.
        fold: what is left out together when a prediction is judged, shape (W,).
        scale: times `sigma` by which residuals are weighed, shape (R, 2J): what a channel of a
            recording is off by with the best hypothesis, so that none shouts the others down.
    """

    base: Model
    windows: Windows
    sigma: Array
    train: Array
    footing: Footing | None = None
    block: Array | None = None
    fold: Array | None = None
    scale: Array | None = None

    @property
    def weight(self) -> Array:
        """What residuals are divided by, shape (R, 2J)."""
        return self.sigma if self.scale is None else self.sigma * self.scale

    @property
    def by_start(self) -> Array | None:
        """Sensitivity of the sensed states to the start states, where it is known."""
        return None if self.footing is None else self.footing.by_start

    def take(self, index: Array) -> Problem:
        """The problem on some of its windows."""
        footing = self.footing and self.footing.take(index)
        block, fold = (x if x is None else x[index] for x in (self.block, self.fold))
        return replace(self, windows=self.windows.take(index), train=self.train[index],
                       footing=footing, block=block, fold=fold)  # fmt: skip


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis.

    Attributes:
        hypothesis: what was free.
        theta: its parameters, shape (P,).
        covariance: of theta, from the training windows, wider where more than noise is left,
            shape (P, P).
        start: start states, shape (W, 2J).
        loss: robust cost of each window [nats], shape (W,).
        residual: whitened, start states projected out, shape (W, N).
        columns: its sensitivity to the parameters, shape (W, N, P).
    """

    hypothesis: Hypothesis
    theta: Array
    covariance: Array
    start: Array
    loss: Array
    residual: Array
    columns: Array

    def take(self, index: Array) -> Fit:
        """The fit as it is on some of its windows."""
        return replace(self, start=self.start[index], loss=self.loss[index],
                       residual=self.residual[index], columns=self.columns[index])  # fmt: skip

    def ci95(self, index: int) -> tuple[float, float]:
        """95 % confidence interval of parameter `index`, within its bounds."""
        half = 1.96 * float(np.sqrt(max(self.covariance[index, index], 0.0)))
        low, high = self.hypothesis.low[index], self.hypothesis.high[index]
        value = float(self.theta[index])
        return max(value - half, float(low)), min(value + half, float(high))


def fit(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Array | None = None,
    start: Array | None = None,
    iterations: int = 8,
) -> Fit:
    """Gauss-Newton over parameters and start states, with shorter and shorter steps and bounds.

    Only the training windows move the parameters; every window moves its own start state. Where a
    step does not save what the linearisation promises, it is judged by its loss once the start
    states have settled there: dry friction bends what they do.
    """
    theta = hypothesis.bounded(hypothesis.neutral if theta is None else theta)
    if start is None and problem.footing:
        start = problem.footing.start
    if start is None:
        start = settle(problem, hypothesis, theta, [problem.windows.measured[:, 0]], rounds=6)
    if problem.footing and not hypothesis.size:
        return _read_off(problem, _evaluate(problem, hypothesis, theta, start))
    best = _walked(problem, hypothesis, theta, start)
    for number in range(PATIENCE * iterations if hypothesis.size else 0):
        best, gained = _stepped(problem, hypothesis, best)
        enough = _enough(problem, best, number >= iterations)
        if gained < enough:
            best, gained = _released(problem, hypothesis, best)
        if gained < enough:
            break
    return _read_off(problem, best)


def _enough(problem: Problem, best: _Point, late: bool) -> float:
    """What a step must save to be followed by another [nats]."""
    if problem.footing:
        return float('inf') if late else FOOTED_NATS
    least, share = (FAR_NATS, FAR_SHARE) if late else (ENOUGH_NATS, ENOUGH_SHARE)
    return max(least, share * float(shooting.huber(best.linear.residual[problem.train]).sum()))


def read_at(problem: Problem, fitted: Fit) -> Fit:
    """A fit as it is in another weighting of the residuals, its values and their errors kept."""
    point = _evaluate(problem, fitted.hypothesis, fitted.theta, fitted.start)
    if not problem.footing:
        point = _walked(problem, fitted.hypothesis, fitted.theta, fitted.start)
    return replace(_read_off(problem, point), theta=fitted.theta, covariance=fitted.covariance)


def settled_as(problem: Problem, fitted: Fit, other: Fit) -> Fit:
    """The fit with the start states of another one in the windows where they suit it better.

    A contact may settle in two ways; what another hypothesis gains by that alone is no gain.
    """
    held = _held(problem, fitted.hypothesis, fitted.theta)
    point = _evaluate(held, Hypothesis(), np.zeros(0), other.start)
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

    def saved(residual: Array) -> float:
        left = np.minimum(shooting.huber(residual), most)
        return float((np.minimum(loss, most) - left)[problem.train].sum())

    for scale in SCALES:
        theta, start = _along(hypothesis, best.theta, best.start, step, scale)
        trial = _evaluate(problem, hypothesis, theta, start)
        gained = saved(trial.linear.residual)
        if gained < KEPT * saved(_ahead(best, trial)):
            trial = _walked(problem, hypothesis, theta, start, best.start)
            gained = saved(trial.linear.residual)
        if gained > 0:
            return trial, gained
    return best, 0.0


def _ahead(best: _Point, trial: _Point) -> Array:
    """The residual that the linearisation at one point promises at another one, (W, N)."""
    linear = best.linear
    moved = (linear.by_start @ (trial.start - best.start)[..., None])[..., 0]
    return linear.residual + moved + linear.by_theta @ (trial.theta - best.theta)


def looked_at(problem: Problem, hypothesis: Hypothesis, theta: Array) -> tuple[Fit, Step]:
    """A hypothesis on the ground as it is at some values, and the Gauss-Newton step from there."""
    assert problem.footing
    point = _evaluate(problem, hypothesis, hypothesis.bounded(theta), problem.footing.start)
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
    if not problem.footing:
        return float('inf')
    return OUT_OF_LINE * float(np.median(loss[problem.train]))


def _sound_step(problem: Problem, point: _Point) -> Step:
    loss = shooting.huber(point.linear.residual)
    return _step(problem, point, problem.train & (loss < _in_line(problem, loss)))


def _walked(problem: Problem, hypothesis: Hypothesis, theta: Array, *starts: Array) -> _Point:
    """The point where the starts have settled, in each window the best of those given."""
    return _evaluate(problem, hypothesis, theta, settle(problem, hypothesis, theta, starts))


def _released(
    problem: Problem, hypothesis: Hypothesis, best: _Point
) -> tuple[_Point, float]:
    """The point with the starts that settle better from where they were measured, and its gain.

    A joint that friction holds does not answer to its start, which may be caught there. Contacts
    have settled before.
    """
    if problem.footing:
        return best, 0.0
    measured = problem.windows.measured[:, 0]
    point = _walked(problem, hypothesis, best.theta, best.start, measured)
    saved = shooting.huber(best.linear.residual) - shooting.huber(point.linear.residual)
    return point, float(saved[problem.train].sum())


@dataclass(frozen=True)
class _Point:
    """A hypothesis at one set of values; `rest` has the start states projected out."""

    hypothesis: Hypothesis
    theta: Array
    start: Array
    linear: shooting.Linear
    rest: Array


@dataclass(frozen=True)
class Step:
    """The step of the parameters, and of each start state: start + gain (change of theta)."""

    theta: Array
    start: Array
    gain: Array


def _evaluate(problem: Problem, hypothesis: Hypothesis, theta: Array, start: Array) -> _Point:
    linear = shooting.linearise(
        problem.base, problem.windows, problem.weight, hypothesis, theta, start, problem.by_start
    )
    rest = shooting.eliminate(linear)[0]
    return _Point(hypothesis, theta, start, linear, rest)


def _step(problem: Problem, point: _Point, chosen: Array | None = None) -> Step:
    """The next step; parameters by the training windows, or those `chosen` (W,)."""
    chosen = problem.train if chosen is None else chosen
    weight = shooting.robust_weight(point.rest)
    residual, by_theta, start, gain = shooting.eliminate(point.linear, weight)
    step = np.zeros(len(point.theta))
    if len(step):
        quiet = calm(problem, by_theta[chosen])
        columns = by_theta[chosen] * quiet
        slope = np.einsum('wnp,wn->p', columns, residual[chosen] * quiet[..., 0])
        ridge = RIDGE_ON_GROUND if problem.footing else RIDGE
        step = _bounded_step(_gram(columns), slope, point, ridge)
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


def settle(
    problem: Problem, hypothesis: Hypothesis, theta: Array, starts: Sequence[Array],
    rounds: int = ROUNDS,
) -> Array:
    """The start states that fit best with the parameters held, each window on its own (W, 2J).

    Args:
        problem: the windows.
        hypothesis: what acts.
        theta: its values, shape (P,).
        starts: where to begin; each settles, and in each window the best is kept.
        rounds: Gauss-Newton steps, shorter where the one before led nowhere.
    """
    count = problem.windows.count
    held = _held(problem, hypothesis, theta).take(np.tile(np.arange(count), len(starts)))
    at = _Settling.of(held, np.concatenate(starts))
    scale = np.ones((len(at.start), 1))
    for _ in range(rounds):
        trial, before = _Settling.of(held, at.start + scale * at.step), at.loss[held.train].sum()
        scale = np.where((trial.loss < at.loss)[:, None], 1.0, 0.3 * scale)
        at = at.or_better(trial)
        if before - at.loss[held.train].sum() < SETTLED_SHARE * before:
            break
    best = at.loss.reshape(-1, count).argmin(axis=0)
    return at.start[best * count + np.arange(count)]


class _Settling(NamedTuple):
    """Start states (W, 2J), the loss of each window there [nats], and where each would go next."""

    start: Array
    loss: Array
    step: Array

    @classmethod
    def of(cls, held: Problem, start: Array) -> _Settling:
        """Start states with nothing else free."""
        point = _evaluate(held, Hypothesis(), np.zeros(0), start)
        return cls(start, shooting.huber(point.linear.residual), _step(held, point).start)

    def or_better(self, other: _Settling) -> _Settling:
        """These, and the others in the windows that they suit better."""
        better = (other.loss < self.loss)[:, None]
        return _Settling(np.where(better, other.start, self.start),
                         np.minimum(other.loss, self.loss),
                         np.where(better, other.step, self.step))  # fmt: skip


def _held(problem: Problem, hypothesis: Hypothesis, theta: Array) -> Problem:
    """The problem with the hypothesis at some values in the model, nothing free."""
    model = hypothesis.model(problem.base, theta) if len(theta) else problem.base
    return replace(problem, base=model)


def _read_off(problem: Problem, point: _Point) -> Fit:
    """Loss, residual and covariance of a point."""
    columns = shooting.eliminate(point.linear)[1]
    columns = columns * calm(problem, columns)
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


def calm(problem: Problem, by_theta: Array) -> Array:
    """How much of each window counts, (W, 1, 1).

    A contact that comes or goes with a small change of a parameter makes a window answer to it
    many times as strongly as it does to a larger one.
    """
    if not problem.footing or not by_theta.size:
        return np.ones((len(by_theta), 1, 1))
    size = np.sqrt((by_theta**2).sum(axis=1))
    answers = size >= ANSWERS * np.quantile(size, 0.9, axis=0)
    most = LOUD * np.array([np.median(s[a]) for s, a in zip(size.T, answers.T, strict=True)])
    return np.where(size > most, most / np.maximum(size, 1e-12), 1.0).min(axis=1)[:, None, None]


def _gram(columns: Array) -> Array:
    flat = columns.reshape(columns.shape[0] * columns.shape[1], columns.shape[2])
    return flat.T @ flat


def covariance(columns: Array, residual: Array, block: Array, free: Array, spread: float) -> Array:
    """Covariance of the parameters that holds where the model is wrong, shape (P, P).

    The sandwich H^-1 J H^-1 (Godambe 1960, White 1982): H the curvature of the loss, J the
    covariance of its slope, read from how much the slopes of the time blocks differ (Liang and
    Zeger 1986) with the correction B / (B - 1). Of few blocks J is itself uncertain, so it is
    averaged with what the size and the correlation of the residual give, and with Student's t.

    Args:
        columns: sensitivity of the whitened residual to the parameters, shape (W, N, P).
        residual: whitened residual, shape (W, N).
        block: stretch of time of each window, shape (W,).
        free: parameters that are on none of their bounds, shape (P,).
        spread: times the residual exceeds white noise, see `shooting.dispersion`.
    """
    scale = np.sqrt(max(1.0, float(np.median(residual**2)) / MEDIAN_CHI2))
    weight = shooting.robust_weight(residual / scale)[..., None]
    inverse = _inverse(_gram(columns * np.sqrt(weight)), free)
    slopes = np.einsum('wnp,wn->wp', columns * weight, residual)
    _, number = np.unique(block, return_inverse=True)
    slopes = np.stack([np.bincount(number, s) for s in slopes.T], axis=-1) if free.size else slopes
    count = len(slopes)
    sandwich = inverse @ (slopes.T @ slopes) @ inverse * count / max(count - 1, 1)
    mixed = 0.5 * (sandwich + spread * inverse)
    return mixed * (stdtrit(max(count - 1, 1), 0.975) / 1.96) ** 2


def _inverse(information: Array, free: Array) -> Array:
    """Inverse of the information over the free parameters.

    A direction the data do not determine gets a huge variance, a parameter on a bound none.
    """
    scale = np.sqrt(np.maximum(np.diag(information), 1e-30))
    scaled = information / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(scaled[np.ix_(free, free)])
    inverse = np.zeros_like(information)
    inverse[np.ix_(free, free)] = (vectors / np.maximum(values, 1e-12)) @ vectors.T
    return inverse / np.outer(scale, scale)
