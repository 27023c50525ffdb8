# SPDX-License-Identifier: Apache-2.0
"""All effects at once: ordinary losses at every joint first, then rounds of choice and joint fit.

Every joint of a real robot has friction of its own. It is in every hypothesis from the start, and
what else is missing is judged beside it. In short windows predictions answer straight to whatever
is missing, so that a choice by linear algebra holds there; a joint fit in longer ones decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.estimate.background import background
from leo_diffmodel.explain.estimate.estimator import Estimate, Extension, STEPS
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import dispersion, Fit, rest_of, unexplained
from leo_diffmodel.explain.estimate.linear_part import linear_part
from leo_diffmodel.explain.estimate.matrices import Matrices, matrices, Term
from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import shorter
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.select.choice import choose, Kept, Price, pruned
from leo_diffmodel.explain.select.evidence import at_joints, Scored
from leo_diffmodel.explain.select.sets import EVERYWHERE, Sets, widens

Array = np.ndarray
ORDINARY = ('viscous_friction', 'coulomb_friction')
"""Losses that every joint has."""


def searched_at_once(sets: Sets, first: Estimate, recordings: Sequence[Recording]) -> Scored:
    """The set that is chosen when all effects are heard together.

    Where the time is over it is the best so far.

    Args:
        sets: takes what is fitted.
        first: the model as given.
        recordings: all of them, for shorter windows.
    """
    everywhere = {c.effect.name for c in sets.pool if c.where != EVERYWHERE}
    pool = [c for c in sets.pool if c.where != EVERYWHERE or c.effect.name not in everywhere]
    sets.progress.expect(2 * len(pool) + STEPS.end)
    rounds = _Rounds(sets, first, pool)
    sets.add([first])
    begun = rounds.begun(recordings)
    fitted = fit(first.problem, begun.hypothesis, begun.theta)
    sets.progress('all losses at once', STEPS.fit)
    fitted, made = rounds.settled(first.problem, fitted)
    best = _supported(sets, rounds.seen(first._replace(fit=fitted), made))
    if not best.names <= {t.candidate for t in made.members}:
        made = rounds.matrices(first.problem, best.fit)
    scans = (*made.scans, *_scans(made, begun))
    sets.extensions[frozenset()] = Extension(first, (), scans, made.threshold)
    sets.front = (best.names,) if sets.late else ()
    sets.background = background(made, [*best.names], max(dispersion(best.fit), 1.0))
    return best


class _Rounds:
    """Choice and joint fit in turn; none of the pool acts at all joints at once."""

    def __init__(self, sets: Sets, first: Estimate, pool: Sequence[Candidate]):
        self._sets, self._first, self._pool = sets, first, pool

    def begun(self, recordings: Sequence[Recording]) -> Fit:
        """What short windows say: ordinary losses, and whatever else they need."""
        ordinary = tuple(c for c in self._pool if _ordinary(c))
        short = shorter(self._first.posed, recordings)
        constants = self._first.fit.hypothesis.constants
        begun = self._fitted(short, Hypothesis(ordinary, constants))
        for _ in range(short.numerics.most_rounds):
            if short.late() or _noise_is_left(short, begun):
                break
            begun, again = self._round(short, begun, self.matrices(short, begun))
            if again:
                break
        return begun

    def settled(self, problem: Problem, fitted: Fit) -> tuple[Fit, Matrices]:
        """Rounds until the set repeats or leaves what does not matter, and its matrices."""
        for _ in range(problem.numerics.most_rounds):
            made = self.matrices(problem, fitted)
            if not rest_of(problem, self._first.fit, fitted).matters:
                fitted, more = self._one_more(problem, fitted, made)
                return fitted, self.matrices(problem, fitted) if more else made
            fitted, again = self._round(problem, fitted, made)
            if again:
                break
        return fitted, made

    def _one_more(self, problem: Problem, fitted: Fit, made: Matrices) -> tuple[Fit, bool]:
        """With an effect that explains most of the little that is left, if there is one.

        Of a robot that is wrong in many small ways each would explain a part of it.
        """
        noise = 0.5 * made.samples
        left = made.least(made.members)[0] - noise
        terms = self._chosen(problem, fitted, made)
        new = [t for t in terms if t not in made.members]
        if problem.late() or not new or left <= 0:
            return fitted, False
        first = max(new, key=lambda t: made.gains(made.members, [[t]])[0])
        if made.gains(made.members, [[first]])[0] < (1 - problem.gates.share) * left:
            return fitted, False
        terms = [t for t in terms if t in made.members or t is first]
        return self._fitted(problem, *made.hypothesis(terms), fitted.start), True

    def _round(self, problem: Problem, fitted: Fit, made: Matrices) -> tuple[Fit, bool]:
        """One choice and its joint fit, and whether the choice is the same again."""
        terms = self._chosen(problem, fitted, made)
        if problem.late() or {t.candidate for t in terms} == {*fitted.hypothesis.candidates}:
            return fitted, True
        return self._fitted(problem, *made.hypothesis(terms), fitted.start), False

    def matrices(self, problem: Problem, fitted: Fit) -> Matrices:
        """All effects about a fit."""
        scales, progress = self._sets.estimator.scales, self._sets.progress
        return matrices(problem, fitted, scales, self._pool, progress)

    def _fitted(
        self,
        problem: Problem,
        hypothesis: Hypothesis,
        theta: Array | None = None,
        start: Array | None = None,
    ) -> Fit:
        """A joint fit; what start states do changes with every step of so many effects."""
        steps = problem.numerics.joint_steps
        return fit(problem, hypothesis, theta, start, iterations=steps, thorough=True)

    def seen(self, at: Estimate, made: Matrices) -> Estimate:
        """A fit less what is not worth its price or changes nothing that anybody can see."""
        price = _price(at.problem, at.fit, made)
        terms = self._seen(made, pruned(made, list(made.members), price))
        if len(terms) == len(made.members):
            return at
        fitted = self._fitted(at.problem, *made.hypothesis(terms), at.fit.start)
        return at._replace(fit=fitted)

    def _chosen(self, problem: Problem, fitted: Fit, made: Matrices) -> list[Term]:
        """What is worth its price and can be seen; ordinary losses are."""
        terms = choose(made, _price(problem, fitted, made), problem.numerics, _ordinary)
        return self._seen(made, terms, _ordinary)

    def _seen(self, made: Matrices, terms: list[Term], kept: Kept = lambda _: False) -> list[Term]:
        """The terms less those that change nothing that anybody can see, the least first."""
        while able := [t for t in terms if not kept(t.candidate)]:
            floors = [self._floors(made, terms, t) for t in able]
            if min(floors) >= self._first.problem.gates.least_floors:
                break
            terms = [t for t in terms if t is not able[int(np.argmin(floors))]]
        return terms

    def _floors(self, made: Matrices, terms: Sequence[Term], term: Term) -> float:
        """What a term changes predictions by, far ahead, the others refitted [noise floors]."""
        ends = (self._ends(made, some) for some in (terms, [t for t in terms if t is not term]))
        change = np.subtract(*ends)
        far = float(np.sqrt(at_joints((change**2).mean(axis=0)).max()))
        return far if np.isfinite(far) else np.inf

    def _ends(self, made: Matrices, terms: Sequence[Term]) -> Array:
        hypothesis, theta = made.hypothesis(terms)
        at = replace(made.fit, hypothesis=hypothesis, theta=theta)
        return self._sets.estimator.ends(self._first._replace(fit=at))


def _price(problem: Problem, fitted: Fit, made: Matrices) -> Price:
    """What an effect must save, where residuals are as much alike in time as here."""
    spread = max(dispersion(fitted), 1.0)
    samples = max(float(likelihood.degrees(fitted.residual, 0).sum()) / spread, 2.0)
    parameter = problem.gates.price * float(np.log(samples))
    return Price(made.threshold * spread, parameter * spread)


def _ordinary(candidate: Candidate) -> bool:
    return candidate.effect.name in ORDINARY


def _noise_is_left(problem: Problem, fitted: Fit) -> bool:
    return unexplained(fitted) < problem.gates.correlated


def _scans(made: Matrices, begun: Fit) -> list[Scan]:
    """What leaving out each effect of a fit costs, with its values in short windows."""
    full, none, found = made.fit.hypothesis, np.zeros((0, 0)), []
    whole = made.least(made.members)[0]
    for term in made.members:
        cost = made.least([t for t in made.members if t is not term])[0] - whole
        source = begun if term.candidate in begun.hypothesis.candidates else made.fit
        theta = made.fit.with_values(source.own(term.candidate))
        scan = Scan(
            term.candidate, theta, cost, none, cost, none, np.zeros(0), full.first_constant
        )
        found.append(scan)
    return found


def _supported(sets: Sets, at: Estimate) -> Scored:
    """The set of an estimate less its effects that folds do not support.

    It is fitted again where leaving out one of them costs more than noise gives: the others are
    then far from where they were linearised.
    """
    problem, whole = at.problem, at
    while not sets.late and (weak := _weakest(sets, at)):
        at = weak.at
        cost = at.fit.lost(problem.train) - whole.fit.lost(problem.train)
        if cost > sets.threshold * sets.weight.spread:
            at = whole = sets.estimator.refitted(at, at.fit.hypothesis, at.fit.theta)
    if sets.late:
        sets.add([at])
    if at is whole or sets.late:
        return sets.known[at.names]
    return _supported(sets, sets.estimator.refitted(at, at.fit.hypothesis, at.fit.theta))


def _weakest(sets: Sets, at: Estimate) -> Scored | None:
    """The set less the effect that is worth least, if this is not surely worth anything."""
    sets.add([at])
    mine = sets.known[at.names]
    parts = [_part(sets, at, c) for c in at.fit.hypothesis.candidates]
    parts += [_narrower(sets, at, c, law) for c in at.names for law in sets.pool if widens(c, law)]
    weak = [part for part in parts if not _matters(sets, part, mine)]
    return min(weak, key=lambda part: sets.weight.ahead(mine, part), default=None)


def _part(sets: Sets, at: Estimate, out: Candidate) -> Scored:
    """A set less one effect, by its linear answer unless it was fitted."""
    names = at.names - {out}
    if names not in sets.known:
        sets.add([at._replace(fit=linear_part(at.problem, at.fit, [out]))])
    return sets.known[names]


def _narrower(sets: Sets, at: Estimate, wide: Candidate, law: Candidate) -> Scored:
    """A set with a narrower law in the place of a wider one, fitted from its values."""
    names = at.names - {wide} | {law}
    if names not in sets.known:
        full, theta = at.fit.hypothesis, at.fit.theta
        values = full.values(theta, full.candidates.index(wide))
        own = [
            [values[p.name] for p in law.parameters] if c == wide else at.fit.own(c)
            for c in full.candidates
        ]
        candidates = tuple(law if c == wide else c for c in full.candidates)
        begin = np.concatenate([*own, theta[full.first_constant :]])
        part = Hypothesis(candidates, full.constants)
        sets.add([sets.estimator.refitted(at, part, begin)])
    return sets.known[names]


def _matters(sets: Sets, part: Scored, whole: Scored) -> bool:
    """Whether a set predicts surely better than a part of it, and by what anybody can see."""
    weight = sets.weight
    if weight.floors(part, whole) < weight.gates.least_floors:
        return False
    return weight.supports(part, whole, sets.threshold) and (
        weight.tells_apart(part, whole) or weight.explains_most(part, whole)
    )
