# SPDX-License-Identifier: Apache-2.0
"""How well hypotheses predict what they were not fitted to, and how much that varies.

The data are cut into folds (recordings, or long blocks of one). Each fold is predicted by the
parameters that all others give: leave-one-group-out cross-validation, by one Newton step from the
joint fit. Sums over folds are compared; how far the folds disagree is the error of a comparison.
docs/evidence.md has the equations and what they assume.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from leo_diffmodel.explain.estimate.covariance import derivatives
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.settings import Gates, Numerics

Array = np.ndarray


@dataclass(frozen=True)
class Scored:
    """A hypothesis with what it leaves of the data it was not fitted to.

    Attributes:
        at: the hypothesis, fitted.
        left: loss of each training window, predicted from the other folds [nats], shape (W,).
        fold: what was left out with each of them, shape (W,).
        behind: nats that count by which longer windows put it behind the best of its rivals.
        ends: errors of the states it predicts for the ends of long windows from their measured
            start, in noise floors there, shape (V, 2J); None where that does not matter.
    """

    at: Estimate
    left: Array
    fold: Array
    behind: float = 0.0
    ends: Array | None = None

    @property
    def fit(self) -> Fit:
        """The joint fit."""
        return self.at.fit

    @property
    def names(self) -> frozenset[Candidate]:
        """Its effects."""
        return self.at.names

    @property
    def size(self) -> int:
        """How many parameters it has."""
        return self.fit.hypothesis.size


@dataclass(frozen=True)
class Saved:
    """What a hypothesis saves of the loss of another in data that neither was fitted to.

    Attributes:
        nats: in all folds.
        error: standard deviation of that sum, from how far the folds are from what the change of
            the prediction promises in them: a fold that cannot show an effect does not disagree.
    """

    nats: float
    error: float


@dataclass(frozen=True)
class Weight:
    """What a nat counts where residuals are no white noise.

    Attributes:
        spread: times the residuals exceed white noise; nats count so much less.
        samples: effective number of independent samples.
        most: what a single window may say for or against a hypothesis [nats, raw]: no more than
            one contact that flips may decide.
        gates: what counts.
        folds: the folds that count, shape (F,); None for all.
        null: the model as given.
    """

    spread: float
    samples: float
    most: float
    gates: Gates
    folds: Array | None = None
    null: Scored | None = None

    @property
    def price(self) -> float:
        """Of a parameter [nats that count]."""
        return self.gates.price * float(np.log(max(self.samples, 2.0)))

    def ahead(self, a: Scored, b: Scored) -> float:
        """Nats that count by which `a` is better than `b`, the price of parameters included."""
        saved = float(self._saved(b, a).sum()) / self.spread
        return saved + self.price * (b.size - a.size) + b.behind - a.behind

    def ordered(self, sets: Sequence[Scored]) -> list[Scored]:
        """The best first: by what each is behind the best of all."""
        best = reduce(lambda a, b: a if self.ahead(a, b) >= 0 else b, sets)
        return sorted(sets, key=lambda s: self.ahead(best, s))

    def compare(self, smaller: Scored, larger: Scored) -> Saved:
        """What one saves in each fold, beside what it should save there."""
        saved = self._by_fold(self._saved(smaller, larger), larger)
        promised = self._by_fold(np.minimum(_promised(smaller, larger), self.most), larger)
        kept = float(saved.sum()) / max(float(promised.sum()), 1e-12)
        apart, count = saved - kept * promised, len(saved)
        error = np.sqrt((apart**2).sum() * count / max(count - 1, 1))
        return Saved(float(saved.sum()), float(error))

    def saves(self, smaller: Scored, larger: Scored, limit: float) -> bool:
        """Whether a set predicts better than one of fewer effects or parameters, all counted.

        What it saves must be beyond what noise gives, and more than a trifle of what nothing
        explains.

        Args:
            smaller: a hypothesis; the larger need not hold its effects.
            larger: a hypothesis with more parameters or effects.
            limit: gain that noise alone can give an effect [nats].
        """
        if self.ahead(larger, smaller) <= 0:
            return False
        more = max(len(larger.names) - len(smaller.names), 1)
        least = more * max(limit * self.spread, self.trifle(larger))
        return bool(self._saved(smaller, larger).sum() > least)

    def supports(self, smaller: Scored, larger: Scored, limit: float) -> bool:
        """Whether a set `saves`, beyond how far the folds disagree about it too."""
        return self.saves(smaller, larger, limit) and self.surely_ahead(larger, smaller)

    def tells_apart(self, smaller: Scored, larger: Scored) -> bool:
        """Whether a set predicts another thing than a smaller one.

        By a part of all that it does, or by some times what it is itself off by (the noise floor
        at least): mean square over the ends of long windows, predicted from their measured start,
        at the joint where it is most.
        """
        null = self.null and self.null.ends
        if null is None or smaller.ends is None or larger.ends is None:
            return True
        added, done = (_at_joints(larger.ends - e) for e in (smaller.ends, null))
        left = self.gates.far_times**2 * np.maximum(_typical(larger.ends), 1.0)
        least = np.minimum(self.gates.part * (done + 1.0), left)
        return bool((added >= least).any())

    def surely_ahead(self, a: Scored, b: Scored) -> bool:
        """Whether `a` predicts better than `b` beyond how far the folds disagree about it."""
        saved = self.compare(b, a)
        return saved.nats > self.gates.least_errors * saved.error

    def unexplained(self, scored: Scored) -> float:
        """What a model that leaves only noise would save [nats], in no window out of line."""
        problem, fitted = scored.at.problem, scored.fit
        left = shooting.unexplained(
            fitted.residual[problem.train], fitted.start.shape[-1], problem.numerics
        )
        most = self.gates.out_of_line * np.median(scored.left)
        return float(self._by_fold(np.minimum(left, most), scored).sum())

    def trifle(self, scored: Scored) -> float:
        """What it would cost to leave a small share more of what is unexplained [nats]."""
        problem, fitted = scored.at.problem, scored.fit
        more = shooting.swollen(
            fitted.residual[problem.train],
            fitted.start.shape[-1],
            problem.numerics,
            self.gates.material,
        )
        return float(self._by_fold(more, scored).sum())

    def _saved(self, smaller: Scored, larger: Scored) -> Array:
        """What one hypothesis saves of another's loss in each window that counts, shape (W,)."""
        saved: Array = np.clip(smaller.left - larger.left, -self.most, self.most)
        return saved if self.folds is None else saved * np.isin(larger.fold, self.folds)

    def _by_fold(self, window: Array, scored: Scored) -> Array:
        sums = np.bincount(scored.fold, window)
        return sums[np.unique(scored.fold) if self.folds is None else self.folds]


def score(at: Estimate) -> Scored:
    """Predict each fold from the others."""
    problem, fitted = at.problem, at.fit
    train = np.flatnonzero(problem.train)
    assert problem.fold is not None
    fold, moved = problem.fold[train], fitted.residual[train].copy()
    columns = fitted.columns[train]
    numerics = problem.numerics
    for number, move in _moves(fitted, moved, columns, fold, numerics).items():
        inside = fold == number
        moved[inside] += columns[inside] @ move
    channels = fitted.start.shape[-1]
    before, after = (
        shooting.loss(e, channels, numerics, fitted.typical)
        for e in (fitted.residual[train], moved)
    )
    return Scored(at, fitted.loss[train] + (after - before), fold)


def _at_joints(change: Array) -> Array:
    """Mean square of a change of states (V, 2J) at each joint, (J,)."""
    square = (change**2).mean(axis=0)
    return np.asarray(square.reshape(2, -1).mean(axis=0))


def _typical(errors: Array) -> Array:
    """Mean square at each joint, (J,), of errors (V, 2J) that are normal but for a few windows."""
    square = np.median(errors**2, axis=0) / 0.455  # median of the square of a normal variable
    return np.asarray(square.reshape(2, -1).mean(axis=0))


def _promised(smaller: Scored, larger: Scored) -> Array:
    """What the change of the prediction should cost in each window, shape (W,)."""
    problem, residual = larger.at.problem, larger.fit.residual
    train = np.flatnonzero(problem.train)
    change = (smaller.fit.residual - residual)[train]
    return shooting.promised(
        change, residual[train], larger.fit.start.shape[-1], problem.numerics, larger.fit.typical
    )


def _moves(
    fitted: Fit, residual: Array, columns: Array, fold: Array, numerics: Numerics
) -> dict[int, Array]:
    """How far leaving each fold out moves the parameters, where all is linear in them."""
    channels, size = fitted.start.shape[-1], len(fitted.theta)
    slopes, grams = derivatives(columns, residual, channels, numerics, fitted.typical)
    free = fitted.hypothesis.free(fitted.theta) & (np.diagonal(grams.sum(axis=0)) > 0)
    end, moves = slopes.mean(axis=0).sum(axis=0), {}
    for number in np.unique(fold):
        other, move = fold != number, np.zeros(size)
        told = free & (np.diagonal(grams[other].sum(axis=0)) > 0)
        alone = free & fitted.hypothesis.own & ~told
        if told.any() and other.any():
            part = columns[other], residual[other], channels, numerics, fitted.typical
            move[told] = _refitted(part, end, told, fitted.standard_errors)
        if alone.any():
            gram = grams[~other].sum(axis=0)
            move[alone] = _followed(gram, move, alone, numerics.least_damping)
        moves[int(number)] = move
    return moves


def _refitted(
    part: tuple[Array, Array, int, Numerics, Array | None], end: Array, told: Array, errors: Array
) -> Array:
    """The change of the parameters `told` that is best for part of the windows.

    The weights of the samples are found again with each step. What slope a window has on average
    where the joint fit ended is not followed.
    """
    columns, residual, channels, numerics, typical = part
    move = np.zeros(len(end))
    for _ in range(numerics.refits):
        slopes, grams = derivatives(
            columns, residual + columns @ move, channels, numerics, typical
        )
        slope = (slopes.sum(axis=(0, 1)) - len(slopes) * end)[told]
        step = -_solved(grams.sum(axis=0)[np.ix_(told, told)], slope, numerics.least_damping)
        move[told] = _within(move[told] + step, numerics.farthest_errors * errors[told])
        if (np.abs(step) < numerics.refit_errors * errors[told]).all():
            break
    return move[told]


def _within(step: Array, bound: Array) -> Array:
    """A step shortened to stay within bounds (P,); it keeps its direction."""
    return step * min(1.0, float((bound / np.maximum(np.abs(step), 1e-300)).min()))


def _followed(gram: Array, move: Array, alone: Array, damping: float) -> Array:
    """How a recording's own constants, which no other fold tells, answer to a move of the others.

    They are to their recording what its start state is to a window: found anew in the fold.
    """
    return -_solved(gram[np.ix_(alone, alone)], gram[alone] @ move, damping)


def _solved(gram: Array, slope: Array, damping: float) -> Array:
    scale = np.sqrt(np.maximum(np.diagonal(gram), 1e-300))
    damped = gram / np.outer(scale, scale) + damping * np.eye(len(scale))
    return np.asarray(np.linalg.solve(damped, slope / scale) / scale)


def weigh(sets: Sequence[Scored], most: float = np.inf) -> Weight:
    """What a nat counts: by how much the residuals of the best hypothesis are alike in time.

    Args:
        sets: the hypotheses.
        most: what a single window may say at most, in residuals as white as noise [nats].
    """
    best = min(sets, key=lambda s: float(s.left.sum()))
    problem, fitted = best.at.problem, best.fit
    spread = shooting.dispersion(fitted.residual[problem.train], fitted.start.shape[-1])
    samples = fitted.residual.size / spread
    null = next((s for s in sets if not s.names), None)
    return Weight(spread, samples, most * spread, problem.gates, null=null)
