# SPDX-License-Identifier: Apache-2.0
"""What short windows say of all effects at once: rounds of choice and joint fit.

Every joint of a real robot has friction of its own. It is in every hypothesis from the start, and
what else is missing is judged beside it. In short windows predictions answer straight to whatever
is missing, so that a choice by linear algebra holds there; a joint fit in longer ones decides.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
import time

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate import choice
from leo_diffmodel.explain.estimate.choice import Kept, Price, price_of, pruned
from leo_diffmodel.explain.estimate.estimator import Estimate, Estimator, FIT, most_floors
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import dispersion, Fit, rest_of, unexplained
from leo_diffmodel.explain.estimate.matrices import Matrices, matrices
from leo_diffmodel.explain.estimate.terms import Term
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Candidate, EVERYWHERE, Hypothesis
from leo_diffmodel.explain.problem.pose import shorter
from leo_diffmodel.explain.problem.problem import Problem
from leo_msgs_py.console import Reporter

FRICTION = 'friction'
ORDINARY = ('viscous_friction', 'coulomb_friction')  # losses that every joint has


class Rounds:
    def __init__(
        self, estimator: Estimator, first: Estimate, pool: Sequence[Candidate], progress: Reporter
    ):
        self._estimator, self._first, self._pool = estimator, first, pool
        self._progress = progress

    def of(
        self, recordings: Sequence[Recording], near: Fit | None, hear: Callable[[Estimate], None]
    ) -> Estimate:
        """The set that rounds lead to, from short windows or from a fit `near` the best."""
        begun, problem = near or self.begun(recordings, hear), self._first.problem
        fitted = fit(problem, begun.hypothesis, begun.theta)
        self._progress('all losses at once', 1, FIT)
        hear(self._first._replace(fit=fitted))
        fitted, made = self.settled(problem, fitted)
        return self.seen(self._first._replace(fit=fitted), made)

    def begun(self, recordings: Sequence[Recording], hear: Callable[[Estimate], None]) -> Fit:
        """What short windows say: ordinary losses, and whatever else they need."""
        ordinary = tuple(c for c in self._pool if _ordinary(c))
        short, now = shorter(self._first.posed, recordings), time.monotonic()
        # later fits decide: of the time that there is, they have the most
        until = self._first.problem.until
        short = replace(short, until=now + short.numerics.short_share * (until - now))
        constants = self._first.fit.hypothesis.constants
        begun = self._fitted(short, Hypothesis(ordinary, constants))
        for _ in range(short.numerics.most_rounds):
            if short.late() or unexplained(begun) < short.gates.correlated:
                break
            begun, again = self._round(short, begun, self.matrices(short, begun, self._plain))
            if again:
                break
        hear(Estimate(replace(self._first.posed, problem=short), begun))
        return begun

    def settled(self, problem: Problem, fitted: Fit) -> tuple[Fit, Matrices]:
        """Rounds until the set repeats or leaves what does not matter, and its matrices."""
        for _ in range(problem.numerics.most_rounds):
            made = self.matrices(problem, fitted)
            if not rest_of(problem, self._first.fit, fitted).matters:
                break
            fitted, again = self._round(problem, fitted, made)
            if again:
                break
        return fitted, made

    def _round(self, problem: Problem, fitted: Fit, made: Matrices) -> tuple[Fit, bool]:
        """One choice and its joint fit, and whether the choice is the same again.

        Where the fit is far off, the best of those that have one thing more.
        """
        price = self._price(problem, fitted, made)
        if unexplained(fitted) > problem.gates.far:
            chosen = choice.first_steps(made, price, problem.numerics, _ordinary)
        else:
            chosen = [choice.choose(made, price, problem.numerics, _ordinary)]
        sets = [self._seen(made, terms, _ordinary) for terms in chosen]
        if problem.late() or {t.candidate for t in sets[0]} == {*fitted.hypothesis.candidates}:
            return fitted, True
        fits = [self._fitted(problem, *made.hypothesis(s), fitted.start) for s in sets]
        cost = partial(_cost, problem, price)
        best = min(fits, key=cost)
        return (fitted, True) if cost(best) >= cost(fitted) else (best, False)

    def matrices(
        self, problem: Problem, fitted: Fit, pool: Sequence[Candidate] | None = None
    ) -> Matrices:
        pool = self._pool if pool is None else pool
        return matrices(problem, fitted, self._estimator.scales, pool, self._progress)

    @property
    def _several(self) -> bool:
        problem = self._first.problem
        return len(problem.base.robot.actuators) >= problem.gates.several

    @property
    def _plain(self) -> list[Candidate]:
        """What short windows tell: of friction at several joints the ordinary losses alone."""
        if not self._several:
            return [*self._pool]
        return [c for c in self._pool if c.effect.family != FRICTION or _ordinary(c)]

    def _price(self, problem: Problem, fitted: Fit, made: Matrices) -> Price:
        """At several joints an effect must save a share of what is unexplained, too."""
        price, channels = price_of(problem, fitted, made), fitted.start.shape[-1]
        residual, material = fitted.residual[problem.train], problem.gates.material
        least = float(likelihood.swollen(residual, channels, problem.numerics, material).sum())
        return replace(price, effect=max(price.effect, least)) if self._several else price

    def _fitted(
        self,
        problem: Problem,
        hypothesis: Hypothesis,
        theta: Array | None = None,
        start: Array | None = None,
    ) -> Fit:
        """A joint fit; what start states do changes with every step of so many effects."""
        steps = problem.numerics.joint_steps
        self._progress('all losses at once', 0)
        fitted = fit(problem, hypothesis, theta, start, iterations=steps, thorough=True)
        self._progress('all losses at once', 1, FIT)
        return fitted

    def seen(self, at: Estimate, made: Matrices) -> Estimate:
        price = price_of(at.problem, at.fit, made)
        terms = self._seen(made, pruned(made, list(made.members), price))
        if len(terms) == len(made.members):
            return at
        fitted = self._fitted(at.problem, *made.hypothesis(terms), at.fit.start)
        return at._replace(fit=fitted)

    def _seen(self, made: Matrices, terms: list[Term], kept: Kept = lambda _: False) -> list[Term]:
        """The terms less those that change nothing that anybody can see, the least first."""
        many = self._first.problem.gates.many
        while len(terms) >= many and (able := [t for t in terms if not kept(t.candidate)]):
            floors = self._floors(made, terms, able)
            if min(floors) >= self._first.problem.gates.least_floors:
                break
            terms = [t for t in terms if t is not able[int(np.argmin(floors))]]
        return terms

    def _floors(self, made: Matrices, terms: list[Term], able: list[Term]) -> list[float]:
        """What each term changes predictions by far ahead, the others refitted [noise floors]."""
        whole = self._ends(made, terms)
        parts = ([t for t in terms if t is not out] for out in able)
        far = [most_floors(self._ends(made, part) - whole) for part in parts]
        return [size if np.isfinite(size) else np.inf for size in far]

    def _ends(self, made: Matrices, terms: Sequence[Term]) -> Array:
        hypothesis, theta = made.hypothesis(terms)
        at = replace(made.fit, hypothesis=hypothesis, theta=theta)
        return self._estimator.ends(self._first._replace(fit=at))


def _ordinary(candidate: Candidate) -> bool:
    return candidate.effect.name in ORDINARY and candidate.where != EVERYWHERE


def _cost(problem: Problem, price: Price, fitted: Fit) -> float:
    """Loss of a fit and the price of its effects [nats]; of one, at most what it saves."""
    spread, cost = dispersion(fitted), fitted.lost(problem.train)
    for candidate, saved in zip(fitted.hypothesis.candidates, fitted.saved, strict=True):
        cost += min(price.effect + price.parameter * len(candidate.parameters), spread * saved)
    return cost
