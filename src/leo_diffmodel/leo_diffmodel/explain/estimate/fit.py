# SPDX-License-Identifier: Apache-2.0
"""Fit a hypothesis to the training windows; the start states of all windows follow."""

from dataclasses import dataclass, replace
from math import inf

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.covariance import (
    beyond,
    conditional_errors,
    covariance,
    few_blocks,
    leverage_weight,
)
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.settle import settle
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.shooting import eliminate
from leo_diffmodel.explain.settings import Numerics


def fit(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Array | None = None,
    start: Array | None = None,
    iterations: int | None = None,
    thorough: bool = False,
    by_start: Array | None = None,
    rival: float = inf,
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
        thorough: every step tries the measured start states as well, not the first and last only,
            and finds what start states do. Else that is found again after a step that saves less
            than half of its promise, and at the end.
        by_start: what start states do, shape (W, N, 2J), as another fit nearby has it.
        rival: loss [nats] of another hypothesis; a fit that comes nearer too slowly is given up.
    """
    numerics = problem.numerics
    theta = hypothesis.bounded(hypothesis.neutral if theta is None else theta)
    start = problem.first if start is None else start
    begun = settle(problem, hypothesis, theta, problem.begins(start), by_start)
    nearby = None if thorough else begun.by_start
    at = _Point(problem, hypothesis, theta, begun.start, by_start=nearby)
    damping, settled, ended = numerics.damping, False, not hypothesis.size
    most = numerics.iterations if iterations is None else iterations
    for _ in range(most if hypothesis.size else 0):
        if problem.late():
            break
        there, damping = _advanced(at, damping, thorough)
        ended = there is None and settled
        if ended or (there and there.gives_up(at, rival)):
            at = there or at
            break
        settled = there is None
        at = there or at.to(at.theta, at.settled(_enough(numerics, numerics.step_nats, thorough)))
    return replace((at.to(at.theta, at.start) if at.chord else at).as_fit(), ended=ended)


def read_at(problem: Problem, fitted: Fit) -> Fit:
    """A fit as it is in another weighting of the residuals, its values and their errors kept."""
    weighed, hypothesis = replace(problem, typical=fitted.typical), fitted.hypothesis
    start = settle(weighed, hypothesis, fitted.theta, problem.begins(fitted.start)).start
    errors = conditional_errors(fitted.columns[problem.train])
    found = _Point(problem, hypothesis, fitted.theta, start, errors).as_fit()
    names = ('theta', 'covariance', 'beyond', 'certificate')
    return replace(found, **{name: getattr(fitted, name) for name in names})


def settled_as(problem: Problem, fitted: Fit, other: Fit) -> Fit:
    """The fit with the start states of another one in the windows where they suit it better.

    A contact may settle in two ways; what another hypothesis gains by that alone is no gain.
    """
    fixed = problem.fixed(fitted.hypothesis, fitted.theta)
    linear = fixed.linearised(Hypothesis(), np.zeros(0), other.start)
    channels = other.start.shape[-1]
    loss = likelihood.loss(linear.residual, channels, fixed.numerics, fitted.typical)
    rest, better = eliminate(linear)[0], loss < fitted.loss
    return replace(
        fitted,
        start=np.where(better[:, None], other.start, fitted.start),
        loss=np.minimum(loss, fitted.loss),
        residual=np.where(better[:, None], rest, fitted.residual),
    )


def looked_at(problem: Problem, hypothesis: Hypothesis, theta: Array) -> 'tuple[Fit, Step]':
    """A hypothesis on the ground as it is at some values, and the Gauss-Newton step from there."""
    point = _Point(problem, hypothesis, hypothesis.bounded(theta), problem.first)
    return point.as_fit(), point.step(problem.numerics.damping)


def moved(fitted: Fit, step: 'Step', scale: float) -> Fit:
    """Where so much of a step leads; the rest of the fit is that of before."""
    theta, start = _along(fitted.hypothesis, fitted.theta, fitted.start, step, scale)
    return replace(fitted, theta=theta, start=np.where(np.isfinite(start), start, fitted.start))


def _advanced(at: '_Point', damping: float, thorough: bool) -> 'tuple[_Point | None, float]':
    """The first step, shorter and shorter, that saves something, and the damping of the next.

    None where no step promises anything. Where a step saves less than half of its promise, the
    start states are settled.
    """
    problem, numerics = at.problem, at.problem.numerics
    harder = numerics.harder
    while (step := at.step(damping)).promised > numerics.step_nats:
        theta, start = _along(at.hypothesis, at.theta, at.start, step)
        nearby = None if thorough else at.linear.by_start
        saved = at.saved(problem.fixed(at.hypothesis, theta).residual(start))
        if saved < numerics.kept * step.promised:
            begins = problem.begins(start) if thorough else (start,)
            nats = _enough(numerics, step.promised, thorough)
            settled = settle(at.weighed, at.hypothesis, theta, begins, at.linear.by_start, nats)
            start, saved, nearby = settled.start, at.saved(settled.residual), None
        if saved > 0:
            softer = max(numerics.softest, 1.0 - (2.0 * saved / step.promised - 1.0) ** 3)
            return at.to(theta, start, nearby), max(damping * softer, numerics.least_damping)
        damping, harder = max(damping, 1e3 * numerics.least_damping) * harder, 2.0 * harder
    return None, damping


def _along(
    hypothesis: Hypothesis, theta: Array, start: Array, step: 'Step', scale: float = 1.0
) -> tuple[Array, Array]:
    """Parameters and start states after so much of a step; the starts answer to what is linear."""
    straight = hypothesis.bounded(theta + scale * step.theta) - theta
    moved = hypothesis.moved(theta, scale * step.theta)
    return moved, start + (step.start + step.gain @ straight)


def _enough(numerics: Numerics, promised: float, thorough: bool) -> float:
    """What the start states of all windows may promise after a step that promised so much."""
    return numerics.inexact * promised if thorough else inf


@dataclass(frozen=True)
class Step:
    """A step of the parameters, and of each start state: start + gain (change of theta)."""

    theta: Array  # shape (P,)
    start: Array  # shape (W, 2J)
    gain: Array  # shape (W, 2J, P)
    promised: float = 0.0  # what it saves where all is linear [nats]


class _Point:
    """A hypothesis at some values, linearised there.

    Attributes:
        rest, slope: residual and sensitivity with the start states projected out.
        typical: size of what it is off by in most windows, (1, 2J); see `Problem.typical_of`.
        loss: of each window [nats], shape (W,).
        most: that a window may lose to have a say [nats].
        matrix, descent: of the robust normal equations of the windows that have one.
        answer: `start` and `gain` of a step from here.
        chord: what start states do was found elsewhere, nearby.
    """

    def __init__(
        self,
        problem: Problem,
        hypothesis: Hypothesis,
        theta: Array,
        start: Array,
        errors: Array | None = None,
        by_start: Array | None = None,
    ):
        self.problem, self.hypothesis, self.theta, self.start = problem, hypothesis, theta, start
        self.linear = problem.linearised(hypothesis, theta, start, errors, by_start)
        self.rest, self.slope = eliminate(self.linear)[:2]
        whitened, channels, numerics = self.linear.residual, start.shape[-1], problem.numerics
        self.typical = problem.typical_of(whitened)
        self.loss = likelihood.loss(whitened, channels, numerics, self.typical)
        self.most = numerics.moving * max(float(np.median(self.loss[problem.train])), 1e-12)
        weight = likelihood.robust_weight(whitened, channels, numerics, self.typical)
        residual, columns, solved, gain = eliminate(self.linear, weight)
        chosen = problem.train & (self.loss < self.most)
        leverage = leverage_weight(problem, columns[chosen])
        columns = columns[chosen] * leverage
        self.descent = -np.einsum('wnp,wn->p', columns, residual[chosen] * leverage[..., 0])
        flat = columns.reshape(columns.shape[0] * columns.shape[1], len(theta))
        self.matrix = flat.T @ flat
        self.answer = -solved, -gain
        self.chord = by_start is not None and not problem.on_ground

    @property
    def lost(self) -> float:
        return float(self.loss[self.problem.train].sum())

    def gives_up(self, before: '_Point', rival: float) -> bool:
        """Whether many steps like the last one would not bring the loss to that of a rival."""
        behind = self.lost - rival
        return before.lost - self.lost < self.problem.numerics.hopeless * behind

    @property
    def weighed(self) -> Problem:
        return replace(self.problem, typical=self.typical)

    def settled(self, nats: float) -> Array:
        """The start states that fit best here, which together promise no more, (W, 2J)."""
        weighed, begins = self.weighed, self.problem.begins(self.start)
        return settle(weighed, self.hypothesis, self.theta, begins, nats=nats).start

    def to(self, theta: Array, start: Array, by_start: Array | None = None) -> '_Point':
        """The hypothesis at other values, moved by the standard errors here for its columns."""
        errors = conditional_errors(self.slope[self.problem.train])
        return _Point(self.problem, self.hypothesis, theta, start, errors, by_start)

    def saved(self, residual: Array) -> float:
        """What another residual (W, N) saves of that here, no window out of line [nats]."""
        channels, train = self.start.shape[-1], self.problem.train
        typical = self.problem.typical_of(residual)
        loss = likelihood.loss(residual, channels, self.problem.numerics, typical)
        saved = np.minimum(self.loss, self.most) - np.minimum(loss, self.most)
        return float(saved[train].sum())

    def step(self, damping: float) -> Step:
        theta = self._bounded_step(damping)
        promised = float(self.descent @ theta - 0.5 * theta @ self.matrix @ theta)
        return Step(theta, *self.answer, promised)

    def _bounded_step(self, damping: float) -> Array:
        """The damped step that is best within the bounds, parameters scaled as the damping is."""
        matrix, no_step = self.matrix, self.problem.numerics.no_step
        step, moves = np.zeros(len(matrix)), np.diag(matrix) > 0
        if not moves.any():
            return step
        scale = np.sqrt(np.diag(matrix)[moves])
        low = scale * (self.hypothesis.least(self.theta) - self.theta)[moves]
        high = scale * (self.hypothesis.high - self.theta)[moves]
        scaled = matrix[np.ix_(moves, moves)] / np.outer(scale, scale)
        root = np.linalg.cholesky(scaled + damping * np.eye(len(scale))).T
        target = solve_triangular(root, self.descent[moves] / scale, trans=1)
        bounds = low, np.maximum(high, low + no_step)
        step[moves] = lsq_linear(root, target, bounds, 'bvls').x / scale
        return step

    def as_fit(self) -> Fit:
        problem, train, channels = self.problem, self.problem.train, self.start.shape[-1]
        columns = self.slope * leverage_weight(problem, self.slope)
        block = np.arange(len(train)) if problem.block is None else problem.block
        spread = likelihood.dispersion(self.rest[train], channels)
        prior, of_loss = self.hypothesis.prior(self.theta), (problem.numerics, self.typical)
        data = columns[train], self.rest[train], block[train]
        variance = covariance(*data, prior, spread, channels, *of_loss)
        curve, room = (self.matrix, self.descent), self.hypothesis.room(self.theta)
        further = beyond(*curve, prior, room, spread * few_blocks(block[train]), problem.numerics)
        decrement = self.step(problem.numerics.least_damping).promised
        left = self.loss, self.rest, columns, decrement, self.typical
        by_start = None if problem.on_ground else self.linear.by_start
        given = self.hypothesis, self.theta, variance, further, self.start
        return Fit(*given, *left, by_start=by_start)
