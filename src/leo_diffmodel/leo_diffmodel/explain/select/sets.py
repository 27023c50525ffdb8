# SPDX-License-Identifier: Apache-2.0
"""Choose a set of effects: the best whose every part predicts worse, among its neighbours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
import time

import numpy as np

from leo_diffmodel.explain.estimate.estimator import Estimate, Estimator, Extension, STEPS
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.select.evidence import score, Scored, weigh, Weight
from leo_diffmodel.explain.settings import Settings
from leo_msgs_py.console import Reporter
from leo_sim.effects import Parameter

Array = np.ndarray
Names = frozenset[Candidate]


@dataclass
class Sets:
    """All sets that were fitted, and the extensions that led to them.

    Attributes:
        estimator: fits them.
        pool: all candidates.
        settings: of the problem.
        told: hears what is being tried.
        until: when to stop [s of `time.monotonic`].
        known: the fitted sets by their effects.
        extensions: what was tried on top of which set.
        carried: which set was fitted from the values of which larger one.
        front: sets whose extensions there was no time for.
    """

    estimator: Estimator
    pool: Sequence[Candidate]
    settings: Settings
    told: Reporter
    until: float = np.inf
    known: dict[Names, Scored] = field(default_factory=dict)
    extensions: dict[Names, Extension] = field(default_factory=dict)
    carried: set[tuple[Names, Names]] = field(default_factory=set)
    front: tuple[Names, ...] = ()

    def __post_init__(self) -> None:
        self.told = Reporter.of(self.told)

    @property
    def weight(self) -> Weight:
        """What a nat counts, by the best set so far."""
        return weigh(list(self.known.values()), self.estimator.most_nats)

    @property
    def late(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.until

    @property
    def untried(self) -> tuple[str, ...]:
        """What there was no time for, in words."""
        begun = [
            _label([*names, *added]) for names, e in self.extensions.items() for added in e.untried
        ]
        return (*begun, *(f'more beside {_label(names)}' for names in self.front))

    @property
    def threshold(self) -> float:
        """Gain that noise alone can give [nats]."""
        limits = [e.threshold for e in self.extensions.values()]
        return max(self.settings.gates.least_nats, min(limits, default=0.0))

    def ordered(self) -> list[Scored]:
        """The best first."""
        return self.weight.ordered(list(self.known.values()))

    def add(self, sets: Iterable[Estimate]) -> None:
        """Score fitted sets; of two fits of one set the better is kept."""
        for at in sets:
            mine = replace(score(at), ends=self.estimator.ends(at))
            other = self.known.get(at.names)
            if other is None or float(mine.left.sum()) < float(other.left.sum()):
                self.known[at.names] = mine

    def extend(self, names: Names, few: bool = False) -> None:
        """Find what one or two more effects do to a set; once for each.

        Args:
            names: the set.
            few: only single effects, and none that was fitted beside the set already; but those
                with a whole number (the periods of a ripple), which may have been another.
        """
        if names in self.extensions:
            return
        pool = [c for c in self.pool if compatible(names, c)]
        if few:
            pool = [c for c in pool if names | {c} not in self.known or c.has_whole] or pool
        found = self.estimator.extended(self.known[names].at, pool, self.told, few)
        self.extensions[names] = found
        self.add([found.base, *found.larger])

    def expect(self, front: Sequence[Names]) -> None:
        """Tell about how much is to come: the sets to extend, as those before, and the end.

        At the beginning the catalogue says how much one is, and a first answer has neighbours.
        """
        numerics, pool = self.settings.numerics, len(self.pool)
        if self.extensions:
            rounds = len(front) * self.told.clock.done // len(self.extensions)
        else:
            first = STEPS.round(pool, numerics.singles + numerics.first_pairs)
            each = STEPS.round(pool, numerics.singles + numerics.pairs)
            rounds = first + numerics.width * each
        self.told.expect(rounds + STEPS.end)

    def add_parts(self, whole: Scored) -> bool:
        """Fit a set less one effect, for each of them, from its values; False where it was done.

        A part that was fitted from elsewhere may have come to rest in a worse place.
        """
        if self.late:
            return False
        new = [n for n in _parts(whole) if (n, whole.names) not in self.carried]
        self.carried |= {(n, whole.names) for n in new}
        self.add(self._part(n, whole.at) for n in new)
        return bool(new)

    def _part(self, names: Names, near: Estimate) -> Estimate:
        full = near.fit.hypothesis
        part = Hypothesis(tuple(c for c in full.candidates if c in names), full.constants)
        return self.estimator.refitted(near, part, part.carried(full, near.fit.theta))


def _label(names: Iterable[Candidate]) -> str:
    return ' + '.join(c.label for c in names)


def compatible(names: Iterable[Candidate], other: Candidate) -> bool:
    """Whether an effect may stand beside others: not what shares a term with one at its place."""
    return not any(_overlap(c, other) and _terms(c) & _terms(other) for c in names)


def _terms(candidate: Candidate) -> set[Parameter]:
    """What scales an effect: a term of its law each."""
    return {p for p in candidate.parameters if p.scales}


def _overlap(a: Candidate, b: Candidate) -> bool:
    """Whether two effects act at one place."""
    return a.where == b.where or (a.effect.hook == b.effect.hook and 'all' in (a.where, b.where))


def search(sets: Sets, first: Estimate) -> Scored:
    """The set that is chosen once all its neighbours are known, or the time is over."""
    sets.add([first])
    while front := [n for n in _front(sets) if n not in sets.extensions]:
        if sets.late and sets.extensions:
            sets.front = tuple(front)
            break
        sets.expect(front)
        sets.extend(front[0], few=front[0] < best_of(sets).names and bool(front[0]))
    return best_of(sets)


def best_of(sets: Sets) -> Scored:
    """The set that is chosen, once its parts and those of what looks better are fitted."""
    best = chosen(list(sets.known.values()), sets.weight, sets.threshold)
    for scored in sets.ordered()[: sets.settings.numerics.width]:
        if scored is best or sets.late:
            break
        if not _parts(scored) <= sets.known.keys() and sets.add_parts(scored):
            return best_of(sets)
    return best


def best_ended(sets: Sets) -> Scored:
    """The set that is chosen of the model as given and those whose fits have come to their end."""
    ended = [s for s in sets.known.values() if s.fit.ended or not s.names]
    return chosen(ended, sets.weight, sets.threshold)


def chosen(sets: Sequence[Scored], weight: Weight, limit: float) -> Scored:
    """The best of the sets whose every part predicts worse, beyond what noise and chance give.

    Args:
        sets: what there is to choose from; of a set that takes part, each less one effect too.
        weight: what a nat counts, and in which folds.
        limit: gain that noise alone can give an effect [nats].
    """
    for scored in weight.ordered(sets):
        if supported(sets, scored, weight, limit):
            return scored
    return next(s for s in sets if not s.names)


def supported(sets: Sequence[Scored], scored: Scored, weight: Weight, limit: float) -> bool:
    """Whether every part of a set is known and surely predicts worse, and all of fewer effects do.

    What takes more effects to predict what fewer predict as well is no better answer, even where
    it saves more.
    """
    if not _parts(scored) <= {s.names for s in sets}:
        return False
    parts = [s for s in sets if s.size < scored.size and _holds(scored, s)]
    fewer = [s for s in sets if len(s.names) < len(scored.names)]
    return all(weight.supports(s, scored, limit) for s in parts) and all(
        weight.saves(s, scored, limit) and weight.tells_apart(s, scored) for s in fewer
    )


def _supported(sets: Sets) -> list[Scored]:
    """The sets that could be the answer."""
    known, weight, limit = list(sets.known.values()), sets.weight, sets.threshold
    return [s for s in known if supported(known, s, weight, limit)]


def _parts(scored: Scored) -> set[Names]:
    """The set less one effect, for each of them."""
    return {scored.names - {c} for c in scored.names}


def _holds(larger: Scored, smaller: Scored) -> bool:
    """Whether each effect of a set is in another one, itself or as part of a wider law there."""
    return all(any(c == d or widens(d, c) for d in larger.names) for c in smaller.names)


def widens(candidate: Candidate, other: Candidate) -> bool:
    """Whether an effect is a wider law than another one at the same place: Stribeck's, Coulomb's.

    Which of them it is, is no question of two causes.
    """
    return candidate.where == other.where and set(other.parameters) < set(candidate.parameters)


def long_horizon_tie_break(sets: Sets, best: Scored) -> Scored:
    """Of sets that short windows cannot tell apart, the best in the longest that can be fitted."""
    longer, weight, margin = best.at.posed.longer, sets.weight, sets.settings.gates.margin_nats
    near = [
        s
        for s in _supported(sets)
        if len(s.names) == len(best.names) and weight.ahead(best, s) < margin
    ]
    near = _distinct(weight.ordered(near), weight)[: sets.settings.numerics.singles]
    if longer is None or len(near) < 2:
        return best
    posed = replace(best.at.posed, problem=longer)
    again = [score(Estimate(posed, fit(longer, s.fit.hypothesis, s.fit.theta))) for s in near]
    judge = weigh(again)
    first = judge.ordered(again)[0]
    for scored in again:
        mine = sets.known[scored.names]
        sets.known[scored.names] = replace(mine, behind=judge.ahead(first, scored))
    return sets.known[first.names]


def canonical(sets: Sets, best: Scored) -> Scored:
    """Of sets that do as well with as many parameters, the one of fewest effects.

    Then the one whose names come first in the catalogue.
    """
    order, weight = {c: n for n, c in enumerate(sets.pool)}, sets.weight
    alike = [
        s
        for s in _supported(sets)
        if s.size == best.size and abs(weight.ahead(best, s)) <= sets.settings.gates.equal_nats
    ]
    return min(
        alike, key=lambda s: (len(s.names), sorted(order[c] for c in s.names)), default=best
    )


def turns(sets: Sets, seed: int = 0) -> list[Scored]:
    """What is chosen when folds at random are left out of the choice, again and again.

    Folds are left out, not windows: what two windows of one recording have in common would else
    decide (delete-d jackknife, Shao and Wu 1989).
    """
    known, weight, gates = list(sets.known.values()), sets.weight, sets.settings.gates
    folds, rng = np.unique(known[0].fold), np.random.default_rng(seed)
    kept = len(folds) - max(1, round(len(folds) * gates.left_out))
    draws = [rng.permutation(folds)[:kept] for _ in range(gates.turns)]
    limit = sets.threshold * kept / len(folds)
    return [chosen(known, replace(weight, folds=np.sort(d)), limit) for d in draws]


def _front(sets: Sets) -> list[Names]:
    """The sets whose extensions are to be known: the best, others of its size, its parts."""
    if frozenset() not in sets.extensions:
        return [frozenset()]
    best = best_of(sets)
    sets.add_parts(best)
    for candidate in best.fit.hypothesis.candidates:
        _split(sets, best, candidate)
    ordered = _distinct(sets.ordered(), sets.weight)
    alike = [s for s in ordered if len(s.names) == len(best.names) and s.names]
    near = [s.names for s in alike[: sets.settings.numerics.width]]
    parts = [best.names - {c} for c in best.fit.hypothesis.candidates]
    return [n for n in (best.names, *near, *parts) if len(n) < sets.settings.gates.most_effects]


def _distinct(ordered: Sequence[Scored], weight: Weight) -> list[Scored]:
    """The sets less those that do the same as the one before, by other names."""
    kept: list[Scored] = []
    for scored in ordered:
        if not kept or abs(weight.ahead(kept[-1], scored)) > weight.gates.equal_nats:
            kept.append(scored)
    return kept


def _split(sets: Sets, best: Scored, candidate: Candidate) -> None:
    """A value of its own at each joint instead of a shared one."""
    if candidate.where != 'all' or candidate.effect.late or sets.late:
        return
    own = [
        c
        for c in sets.pool
        if c.effect.name == candidate.effect.name and c.where != 'all' and c not in best.names
    ]
    if len(own) < 2 or best.names - {candidate} | set(own) in sets.known:
        return
    hypothesis, theta = best.fit.hypothesis, best.fit.theta
    index = hypothesis.candidates.index(candidate)
    values = list(hypothesis.values(theta, index).values())
    rest = hypothesis.without(index)
    theta = rest.carried(hypothesis, theta)
    split = len(theta) - len(rest.constants)
    wider = replace(rest, candidates=(*rest.candidates, *own))
    theta = np.concatenate([theta[:split], *[values] * len(own), theta[split:]])
    sets.add([sets.estimator.refitted(best.at, wider, theta)])
