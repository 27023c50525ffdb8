# SPDX-License-Identifier: Apache-2.0
"""Choose a set of effects: a beam over sets, with swaps and removals until nothing changes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
import time

import numpy as np

from leo_diffmodel.explain.estimate.estimator import Estimate, Estimator, Extension, Progress
from leo_diffmodel.explain.estimate.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.select.evidence import compare, score, Scored, weigh, Weight
from leo_diffmodel.explain.settings import Settings

Array = np.ndarray
Names = frozenset[Candidate]


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
    """

    estimator: Estimator
    pool: Sequence[Candidate]
    settings: Settings
    told: Progress
    until: float = np.inf
    known: dict[Names, Scored] = field(default_factory=dict)
    extensions: dict[Names, Extension] = field(default_factory=dict)

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
    """The smallest set that no larger one beats, once the neighbours of the best are all known."""
    sets.add([first])
    while not sets.late:
        best = chosen(sets)
        front = [n for n in _front(sets, best) if n not in sets.extensions]
        if not front:
            break
        sets.extend(front[0])
    return chosen(sets)


def chosen(sets: Sets) -> Scored:
    """The best of its size that no set with more parameters is supported over.

    The one-standard-error rule (Breiman et al. 1984): of hypotheses that predict about equally
    well the simplest.
    """
    ordered, weight, limit = sets.ordered(), sets.weight, sets.threshold
    for size in sorted({s.size for s in ordered}):
        mine = next(s for s in ordered if s.size == size)
        better = ordered[: ordered.index(mine)]
        if not any(weight.supports(mine, s, limit) for s in better if s.size > size):
            return mine
    return ordered[0]


def _front(sets: Sets, best: Scored) -> list[Names]:
    """The sets whose extensions are to be known: the best, others of its size, its parts.

    Where something is missing, the best sets with one effect more are tried, too: two effects may
    be supported together that are not one by one.
    """
    if frozenset() not in sets.extensions:
        return [frozenset()]
    count, weight = len(best.names), sets.weight
    alike = [s for s in sets.ordered() if len(s.names) == count and s.names]
    more = [s for s in sets.ordered() if len(s.names) == count + 1
            and compare(best, s).nats > sets.threshold * weight.spread]  # fmt: skip
    for candidate in best.fit.hypothesis.candidates:
        sets.fitted(best.names - {candidate}, best.at)
        _split(sets, best, candidate)
    parts = [best.names - {c} for c in best.fit.hypothesis.candidates]
    near = [s.names for s in (*alike[: sets.settings.width], *more[: sets.settings.ahead])]
    room = [n for n in near if len(n) < sets.settings.most_effects]
    return [*room, *parts]


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
