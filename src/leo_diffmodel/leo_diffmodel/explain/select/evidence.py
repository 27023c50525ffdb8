# SPDX-License-Identifier: Apache-2.0
"""How well hypotheses predict what they were not fitted to, and how much that varies.

The data are cut into folds (recordings, or long blocks of one). Each fold is predicted by the
parameters that all others give: leave-one-group-out cross-validation, by one Newton step from the
joint fit. Sums over folds are compared, and the spread of their differences is the standard error.
docs/evidence.md has the equations and what they assume.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.explain.estimate import shooting
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fit import Fit
from leo_diffmodel.explain.estimate.hypothesis import Candidate
from leo_diffmodel.explain.settings import Settings

Array = np.ndarray
RIDGE = 1e-9
NEARLY = 1.15
"""Times the noise that a recording may be off by without anything being missing."""
FARTHEST = 3.0
"""Standard deviations that leaving a fold out may move the parameters: the step is linear."""


@dataclass(frozen=True)
class Scored:
    """A hypothesis with what it leaves of the folds it was not fitted to.

    Attributes:
        at: the hypothesis, fitted.
        left: loss of each fold predicted from the others [nats], shape (F,).
    """

    at: Estimate
    left: Array

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
class Weight:
    """What a nat counts where residuals are no white noise.

    Attributes:
        spread: times the residuals exceed white noise; nats count so much less.
        samples: effective number of independent samples.
        settings: the gates.
    """

    spread: float
    samples: float
    settings: Settings

    @property
    def price(self) -> float:
        """Of a parameter [nats that count]."""
        return self.settings.price * float(np.log(max(self.samples, 2.0)))

    def score(self, scored: Scored, folds: Array | None = None) -> float:
        """Loss of what was left out with the price of the parameters: less is better.

        Args:
            scored: the hypothesis.
            folds: those that count, all by default.
        """
        left = scored.left if folds is None else scored.left[folds] * len(scored.left) / len(folds)
        return float(left.sum()) / self.spread + self.price * scored.size

    def supports(self, smaller: Scored, larger: Scored, limit: float) -> bool:
        """Whether a set with more parameters predicts better than one with fewer, all counted.

        What it saves must be beyond what noise gives, more than a trifle of what nothing explains,
        and beyond how far the folds disagree about it.

        Args:
            smaller: a hypothesis; the larger need not hold its effects.
            larger: a hypothesis with more parameters.
            limit: gain that noise alone can give an effect [nats].
        """
        saved, more = compare(smaller, larger), max(len(larger.names) - len(smaller.names), 1)
        trifle = self.settings.material * unexplained(larger)
        least = more * max(limit * self.spread, trifle)
        return saved.nats > max(least, self.settings.least_errors * saved.error)


def unexplained(scored: Scored) -> float:
    """Loss of what was left out that is beyond measurement noise [nats].

    Residuals are weighed by what the best hypothesis is off by, so the share of a recording that
    is noise follows from how many times the noise that is.
    """
    problem = scored.at.problem
    if problem.scale is None:
        return 0.0
    assert problem.fold is not None
    beyond = 1.0 - np.minimum(NEARLY / np.sqrt((problem.scale**2).mean(axis=-1)), 1.0) ** 2
    fold, train = problem.fold[problem.train], beyond[problem.windows.source[problem.train]]
    share = np.array([train[fold == f].mean() for f in np.unique(fold)])
    return float((share * scored.left).sum())


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


def compare(without: Scored, scored: Scored) -> Saved:
    """What a hypothesis saves in each fold, beside what it should save there."""
    saved, promised = without.left - scored.left, _promised(without, scored)
    kept = float(saved.sum()) / max(float(promised.sum()), 1e-12)
    apart, count = saved - kept * promised, len(saved)
    return Saved(float(saved.sum()), float(np.sqrt((apart**2).sum() * count / max(count - 1, 1))))


def _promised(without: Scored, scored: Scored) -> Array:
    """Half the squared change of the prediction in each fold, shape (F,)."""
    problem = scored.at.problem
    train = np.flatnonzero(problem.train)
    assert problem.fold is not None
    fold = problem.fold[train]
    change = (without.fit.residual - scored.fit.residual)[train]
    weight = shooting.robust_weight(scored.fit.residual[train])
    window = 0.5 * (weight * change**2).sum(axis=-1)
    return np.array([window[fold == f].sum() for f in np.unique(fold)])


def score(at: Estimate, most: float = np.inf) -> Scored:
    """Predict each fold from the others.

    Args:
        at: a fitted hypothesis.
        most: what a single window may say [nats].
    """
    problem, fitted = at.problem, at.fit
    train = np.flatnonzero(problem.train)
    assert problem.fold is not None
    residual, columns = fitted.residual[train], fitted.columns[train]
    left = np.zeros(int(problem.fold.max()) + 1)
    moves = _moves(fitted, residual, columns, problem.fold[train])
    for fold, move in moves.items():
        inside = problem.fold[train] == fold
        moved = residual[inside] + columns[inside] @ move
        left[fold] = np.minimum(shooting.huber(moved), most).sum()
    return Scored(at, left[np.unique(problem.fold[train])])


def _moves(fitted: Fit, residual: Array, columns: Array, fold: Array) -> dict[int, Array]:
    """How far leaving each fold out moves the parameters, by one Newton step."""
    weight = shooting.robust_weight(residual)[..., None]
    grams = np.einsum('wnp,wnq->wpq', columns * weight, columns)
    slopes = np.einsum('wnp,wn->wp', columns * weight, residual)
    free = (fitted.theta > fitted.hypothesis.low) & (fitted.theta < fitted.hypothesis.high)
    free &= np.diagonal(grams.sum(axis=0)) > 0
    sigma = np.sqrt(np.diagonal(fitted.covariance))
    moves = {}
    for number in np.unique(fold):
        other, move = fold != number, np.zeros(len(fitted.theta))
        if free.any():
            step = _step(grams[other].sum(axis=0), slopes, other, free)
            bound = FARTHEST * sigma[free]
            move[free] = np.clip(step, -bound, bound)
        moves[int(number)] = move
    return moves


def _step(gram: Array, slopes: Array, other: Array, free: Array) -> Array:
    """The change of the free parameters; a slope the joint fit left at its end is not followed."""
    part = gram[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(np.diagonal(part), 1e-300))
    damped = part / np.outer(scale, scale) + RIDGE * np.eye(len(scale))
    inside = slopes[~other].sum(axis=0) - slopes.mean(axis=0) * (~other).sum()
    return np.linalg.solve(damped, inside[free] / scale) / scale


def weigh(sets: Sequence[Scored], settings: Settings) -> Weight:
    """What a nat counts: by the hypothesis whose residuals are nearest to white noise."""
    def spread(scored: Scored) -> float:
        train, fitted = scored.at.problem.train, scored.fit
        return shooting.dispersion(fitted.residual[train], fitted.start.shape[-1])

    least = min(spread(s) for s in sets)
    return Weight(least, sets[0].fit.residual.size / least, settings)
