# SPDX-License-Identifier: Apache-2.0
"""How well hypotheses predict what they were not fitted to, and how much that varies.

The data are cut into folds (recordings, or long blocks of one). Each fold is predicted by the
parameters that all others give: leave-one-group-out cross-validation, by one Newton step from the
joint fit. Sums over folds are compared; how far the folds disagree is the error of a comparison.
docs/evidence.md has the equations and what they assume.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.covariance import derivatives, solved
from leo_diffmodel.explain.estimate.estimator import at_joints, Estimate, most_floors
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.settings import Gates, Numerics


@dataclass(frozen=True)
class Scored:
    """A hypothesis with what it leaves of the data it was not fitted to."""

    at: Estimate  # the hypothesis, fitted
    left: Array  # loss of each training window, predicted from the other folds [nats], shape (W,)
    fold: Array  # what was left out with each of them, shape (W,)
    behind: float = 0.0  # nats by which longer windows put it behind the best of its rivals
    # errors at the ends of long windows from their measured start, in noise floors, (V, 2J)
    ends: Array | None = None

    @property
    def fit(self) -> Fit:
        return self.at.fit

    @property
    def names(self) -> frozenset[Candidate]:
        return self.at.names

    @property
    def size(self) -> int:
        return self.fit.hypothesis.size


@dataclass(frozen=True)
class Weight:
    """What a nat counts where residuals are no white noise."""

    spread: float  # times the residuals exceed white noise; nats count so much less
    samples: float  # effective number of independent samples
    most: float  # for or against, of a single window [nats, raw]: a contact may flip there
    gates: Gates  # what counts
    folds: Array | None = None  # the folds that count, shape (F,); None for all
    null: Scored | None = None  # the model as given
    usual: frozenset[Candidate] = frozenset()  # losses that are in every hypothesis

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

    def compare(self, smaller: Scored, larger: Scored) -> tuple[float, float]:
        """What one saves of the loss in data neither was fitted to, and the error of that [nats].

        That is the standard deviation, from how far the folds are from what the change of the
        prediction promises in them: a fold that cannot show an effect does not disagree.
        """
        saved = self._by_fold(self._saved(smaller, larger), larger)
        change = _residual(smaller)[0] - _residual(larger)[0]
        cost = likelihood.promised(change, *_residual(larger), larger.fit.typical)
        promised = self._by_fold(np.minimum(cost, self.most), larger)
        nats, count = float(saved.sum()), len(saved)
        apart = saved - nats / max(float(promised.sum()), 1e-12) * promised
        error = np.sqrt((apart**2).sum() * count / max(count - 1, 1))
        return nats, float(error)

    def saves(self, smaller: Scored, larger: Scored, limit: float) -> bool:
        """Whether a set predicts better than one of fewer effects or parameters, all counted.

        What it saves must be beyond what noise gives, `limit` for an effect [nats], and not
        negligible beside what nothing explains. It need not hold the effects of the smaller set.
        """
        if self.ahead(larger, smaller) <= 0:
            return False
        more = max(len(larger.names) - len(smaller.names), 1)
        least = more * max(limit * self.spread, self.negligible(larger))
        return bool(self._saved(smaller, larger).sum() > least)

    def supports(self, smaller: Scored, larger: Scored, limit: float) -> bool:
        """Whether a set `saves`, beyond how far the folds disagree about it too."""
        return self.saves(smaller, larger, limit) and self.surely_ahead(larger, smaller)

    def tells_apart(self, smaller: Scored, larger: Scored) -> bool:
        """Whether a set predicts something else than a smaller one.

        By a part of all that it does, or by some times what it is itself off by (the noise floor
        at least): mean square over the ends of long windows, at the joint where it is most.
        """
        null = self.null and self.null.ends
        if null is None or smaller.ends is None or larger.ends is None:
            return True
        changes = (larger.ends - e for e in (smaller.ends, null))
        added, done = (at_joints((c**2).mean(axis=0)) for c in changes)
        # of errors that are normal but for a few windows, whose square has this median
        typical = at_joints(np.median(larger.ends**2, axis=0) / 0.455)
        left = self.gates.far_times**2 * np.maximum(typical, 1.0)
        least = np.minimum(self.gates.part * (done + 1.0), left)
        return bool((added >= least).any())

    def matters(self, smaller: Scored, larger: Scored) -> bool:
        """Whether a larger set predicts something else, and what anybody can see far ahead.

        Beside few others an effect is seen that does half as much; or whatever it does, if it
        explains most of what is left.
        """
        most = self.explains_most(smaller, larger)
        many = len(larger.names) >= self.gates.many
        least = (1.0 if many else self.gates.few_floors) * self.gates.least_floors
        if smaller.ends is None or larger.ends is None:
            seen = True
        else:
            seen = most_floors(larger.ends - smaller.ends) >= least or (most and not many)
        return seen and (most or self.tells_apart(smaller, larger))

    def explains_most(self, smaller: Scored, larger: Scored) -> bool:
        """Whether a set leaves but a small share of what a smaller one leaves beyond noise.

        No window counts for more than a few times what most windows leave.
        """
        most = self.gates.out_of_line * np.median(smaller.left)
        saved = np.minimum(smaller.left, most) - np.minimum(larger.left, most)
        total, left = float(self._by_fold(saved, larger).sum()), self.unexplained(larger)
        return left < self.gates.share * (total + left)

    def surely_ahead(self, a: Scored, b: Scored) -> bool:
        """Whether `a` predicts better than `b` beyond how far the folds disagree about it."""
        nats, error = self.compare(b, a)
        return nats > self.gates.least_errors * error

    def unexplained(self, scored: Scored) -> float:
        """What a model that leaves only noise would save [nats], in no window out of line."""
        left = likelihood.unexplained(*_residual(scored))
        most = self.gates.out_of_line * np.median(scored.left)
        return float(self._by_fold(np.minimum(left, most), scored).sum())

    def leaves_noise(self, scored: Scored, limit: float) -> bool:
        """Whether no more is unexplained than in noise, and what that can give, `limit` [nats]."""
        residual, channels, numerics = _residual(scored)
        shape, rng = (numerics.noise_draws, *residual.shape), np.random.default_rng(0)
        noise = rng.standard_normal(shape) * likelihood.measured(residual)
        of_noise = likelihood.unexplained(noise, channels, numerics).sum(axis=-1).mean()
        return bool(self.unexplained(scored) - of_noise < limit * self.spread)

    def negligible(self, scored: Scored) -> float:
        """What it would cost to leave a small share more of what is unexplained [nats]."""
        more = likelihood.swollen(*_residual(scored), self.gates.material)
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
    problem, fitted, numerics = at.problem, at.fit, at.problem.numerics
    train = np.flatnonzero(problem.train)
    assert problem.fold is not None
    fold, residual, columns = problem.fold[train], fitted.residual[train], fitted.columns[train]
    moved = residual.copy()
    for number, move in _moves(fitted, residual, columns, fold, numerics).items():
        inside = fold == number
        moved[inside] += columns[inside] @ move
    how = fitted.start.shape[-1], numerics, fitted.typical
    before, after = (likelihood.loss(e, *how) for e in (residual, moved))
    return Scored(at, fitted.loss[train] + (after - before), fold)


def _residual(scored: Scored) -> tuple[Array, int, Numerics]:
    """Of the training windows, how many channels it has, and how its loss is computed."""
    problem, fitted = scored.at.problem, scored.fit
    train = np.flatnonzero(problem.train)
    return fitted.residual[train], fitted.start.shape[-1], problem.numerics


def _moves(
    fitted: Fit, residual: Array, columns: Array, fold: Array, numerics: Numerics
) -> dict[int, Array]:
    """How far leaving each fold out moves the parameters, where all is linear in them.

    A recording's own constants, which no other fold shows, are to it what its start state is to a
    window: found anew in the fold.
    """
    channels, damping = fitted.start.shape[-1], numerics.least_damping
    slopes, grams = derivatives(columns, residual, channels, numerics, fitted.typical)
    free = fitted.hypothesis.free(fitted.theta) & (np.diagonal(grams.sum(axis=0)) > 0)
    end, moves = slopes.mean(axis=0).sum(axis=0), {}
    for number in np.unique(fold):
        other, move = fold != number, np.zeros(len(fitted.theta))
        seen = free & (np.diagonal(grams[other].sum(axis=0)) > 0)
        alone = free & fitted.hypothesis.own & ~seen
        if seen.any() and other.any():
            move = _refitted(fitted, residual[other], columns[other], end, seen, numerics)
        if alone.any():
            gram = grams[~other].sum(axis=0)
            move[alone] = -solved(gram[np.ix_(alone, alone)], gram[alone] @ move, damping)
        moves[int(number)] = move
    return moves


def _refitted(
    fitted: Fit, residual: Array, columns: Array, end: Array, seen: Array, numerics: Numerics
) -> Array:
    """The change (P,) of the parameters `seen` that is best for part of the windows.

    The weights of the samples are found again with each step. What slope a window has on average
    where the joint fit ended (`end`) is not followed.
    """
    channels, errors = fitted.start.shape[-1], fitted.standard_errors[seen]
    move = np.zeros(len(end))
    for _ in range(numerics.refits):
        moved_by = residual + columns @ move
        slopes, grams = derivatives(columns, moved_by, channels, numerics, fitted.typical)
        slope = (slopes.sum(axis=(0, 1)) - len(slopes) * end)[seen]
        step = -solved(grams.sum(axis=0)[np.ix_(seen, seen)], slope, numerics.least_damping)
        moved, bound = move[seen] + step, numerics.farthest_errors * errors
        # shortened to stay within the bounds, it keeps its direction
        shorter = float((bound / np.maximum(np.abs(moved), 1e-300)).min())
        move[seen] = moved * min(1.0, shorter)
        if (np.abs(step) < numerics.refit_errors * errors).all():
            break
    return move


def weigh(
    sets: Sequence[Scored], most: float = np.inf, usual: frozenset[Candidate] = frozenset()
) -> Weight:
    """What a nat counts: by how much the residuals of the best hypothesis are alike in time.

    `most` is what a single window may say at most, in residuals as white as noise [nats].
    """
    best = min(sets, key=lambda s: float(s.left.sum()))
    residual, channels, _ = _residual(best)
    spread = likelihood.dispersion(residual, channels)
    null = next((s for s in sets if not s.names), None)
    samples = float(likelihood.degrees(best.fit.residual, 0).sum()) / spread
    gates = best.at.problem.gates
    return Weight(spread, samples, most * spread, gates, null=null, usual=usual)
