# SPDX-License-Identifier: Apache-2.0
"""Choose a set of effects: a beam over sets, with swaps and removals until nothing changes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
import time

import numpy as np

from leo_diffmodel.explain.estimate.estimator import Estimate, Estimator, Extension, Progress
from leo_diffmodel.explain.estimate.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.select.evidence import score, Scored, weigh, Weight
from leo_diffmodel.explain.settings import Settings

Array = np.ndarray
Names = frozenset[Candidate]
MOST_REPAIRS = 6


@dataclass
class Sets:
    """All sets that were fitted, and the extensions that led to them.

    Attributes:
        estimator: fits them.
        pool: all candidates.
        settings: the gates.
        told: hears what is being tried.
        until: when to stop [s of `time.monotonic`].
        known: the fitted sets by their effects.
        extensions: what was tried on top of which set.
        parents: the sets that each set was first an extension of.
    """

    estimator: Estimator
    pool: Sequence[Candidate]
    settings: Settings
    told: Progress
    until: float = np.inf
    known: dict[Names, Scored] = field(default_factory=dict)
    extensions: dict[Names, Extension] = field(default_factory=dict)
    parents: dict[Names, Names] = field(default_factory=dict)

    @property
    def weight(self) -> Weight:
        """What a nat counts, by the best set so far."""
        return weigh(list(self.known.values()), self.settings)

    @property
    def late(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.until

    @property
    def threshold(self) -> float:
        """Gain that noise alone can give [nats]."""
        limits = [e.threshold for e in self.extensions.values()]
        return max(self.settings.least_nats, min(limits, default=0.0))

    def ordered(self) -> list[Scored]:
        """The best first."""
        weight = self.weight
        return sorted(self.known.values(), key=weight.score)

    def add(self, sets: Iterable[Estimate]) -> None:
        """Score fitted sets; of two fits of one set the better is kept."""
        for at in sets:
            mine = score(at, self.estimator.most_nats)
            other = self.known.get(at.names)
            if other is None or self._better(mine, other):
                self.known[at.names] = mine

    def extend(self, names: Names) -> Extension:
        """What one or two more effects do to a set; once for each."""
        if names not in self.extensions:
            pool = [c for c in self.pool if compatible(names, c)]
            found = self.estimator.extended(self.known[names].at, pool, self.told)
            self.extensions[names] = found
            for at in found.larger:
                self.parents.setdefault(at.names, names)
            self.add([found.base, *found.larger])
        return self.extensions[names]

    def fitted(self, names: Names, near: Estimate) -> Scored:
        """A set, fitted from the values that it has in another one that holds all of it."""
        if names not in self.known:
            full = near.fit.hypothesis
            kept = tuple(c for c in full.candidates if c in names)
            part = Hypothesis(kept, full.constants)
            theta = part.carried(full, near.fit.theta)
            self.add([self.estimator.refitted(near, part, theta)])
        return self.known[names]

    def _better(self, mine: Scored, other: Scored) -> bool:
        return float(mine.left.sum()) < float(other.left.sum())


def compatible(names: Iterable[Candidate], other: Candidate) -> bool:
    """Whether an effect may stand beside others: not what one of them holds at its place."""
    mine = set(other.parameters)
    return not any(
        overlap(c, other) and (mine <= set(c.parameters) or set(c.parameters) <= mine)
        for c in names
    )


def overlap(a: Candidate, b: Candidate) -> bool:
    """Whether two effects act at one place."""
    return a.where == b.where or (a.effect.hook == b.effect.hook and 'all' in (a.where, b.where))


def search(sets: Sets, first: Estimate) -> Scored:
    """The best supported set: best-first extension, then swaps and splits until nothing changes."""
    sets.add([first])
    _grow(sets)
    best = chosen(sets)
    for _ in range(MOST_REPAIRS):
        _repair(sets, best)
        _grow(sets)
        better = chosen(sets)
        if better.names == best.names or sets.late:
            return better
        best = better
    return best


def _grow(sets: Sets) -> None:
    """Extend the best sets until none of them promises more."""
    while not sets.late:
        front = [s for s in _front(sets) if s.names not in sets.extensions]
        if not front:
            return
        sets.extend(front[0].names)


def _front(sets: Sets) -> list[Scored]:
    """The sets that are worth extending: the best of those that add what is supported."""
    if frozenset() not in sets.extensions:
        return [sets.known[frozenset()]]
    weight, limit, most = sets.weight, sets.threshold, sets.settings.most_effects
    worth: list[Scored] = []
    for scored in sets.ordered():
        parent = sets.known.get(sets.parents.get(scored.names, scored.names))
        if parent and parent is not scored and len(scored.names) < most:
            if weight.supports(parent, scored, limit):
                worth.append(scored)
        if len(worth) == sets.settings.width:
            break
    return worth


def chosen(sets: Sets) -> Scored:
    """The best set whose every effect is supported beside the others."""
    while True:
        known = len(sets.known)
        for scored in sets.ordered():
            if is_supported(sets, scored):
                return scored
            if len(sets.known) > known:
                break


def is_supported(sets: Sets, scored: Scored) -> bool:
    """Whether the set without any one of its effects predicts worse, the noise counted."""
    for candidate in scored.fit.hypothesis.candidates:
        part = sets.fitted(scored.names - {candidate}, scored.at)
        if not sets.weight.supports(part, scored, sets.threshold):
            return False
    return True


def _repair(sets: Sets, best: Scored) -> None:
    """Try everything in the place of each effect, and a value for each joint."""
    for candidate in best.fit.hypothesis.candidates:
        if not sets.late:
            sets.fitted(best.names - {candidate}, best.at)
            sets.extend(best.names - {candidate})
            _split(sets, best, candidate)


def _split(sets: Sets, best: Scored, candidate: Candidate) -> None:
    """A value of its own at each joint instead of a shared one."""
    if candidate.where != 'all' or candidate.effect.late:
        return
    own = [c for c in sets.pool if c.effect.name == candidate.effect.name and c.where != 'all'
           and c not in best.names]  # fmt: skip
    if len(own) < 2 or best.names - {candidate} | set(own) in sets.known:
        return
    index = best.fit.hypothesis.candidates.index(candidate)
    values = list(best.fit.hypothesis.values(best.fit.theta, index).values())
    kept = best.fit.hypothesis.without(index)
    theta = kept.carried(best.fit.hypothesis, best.fit.theta)
    split = len(theta) - len(kept.constants)
    for one in own:
        kept = kept.with_candidate(one)
    theta = np.concatenate([theta[:split], *[values] * len(own), theta[split:]])
    sets.add([sets.estimator.refitted(best.at, kept, theta)])
