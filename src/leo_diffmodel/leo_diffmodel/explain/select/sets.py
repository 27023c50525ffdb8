# SPDX-License-Identifier: Apache-2.0
"""Sets of effects that were fitted, and the one that is chosen: each part of it predicts worse."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
import time

import numpy as np

from leo_diffmodel.explain.estimate.background import Background
from leo_diffmodel.explain.estimate.estimator import Estimate, Estimator, Extension, STEPS
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.select.evidence import score, Scored, weigh, Weight
from leo_diffmodel.explain.settings import Settings
from leo_msgs_py.console import Reporter
from leo_sim.effects import Parameter

Array = np.ndarray
Names = frozenset[Candidate]
EVERYWHERE = 'all'


@dataclass
class Sets:
    """All sets that were fitted, and the extensions that led to them.

    Attributes:
        estimator: fits them.
        pool: all candidates.
        settings: of the problem.
        progress: is called with what is being tried.
        until: when to stop [s of `time.monotonic`].
        known: the fitted sets by their effects.
        extensions: what was tried on top of which set.
        carried: which set was fitted from the values of which other one.
        numbers: with which whole numbers of which effect a set was fitted.
        front: sets whose extensions there was no time for.
        background: what small differences leave to doubt, where that was asked.
    """

    estimator: Estimator
    pool: Sequence[Candidate]
    settings: Settings
    progress: Reporter
    until: float = np.inf
    known: dict[Names, Scored] = field(default_factory=dict)
    extensions: dict[Names, Extension] = field(default_factory=dict)
    carried: set[tuple[Names, Names]] = field(default_factory=set)
    numbers: set[tuple] = field(default_factory=set)
    front: tuple[Names, ...] = ()
    background: Background | None = None

    def __post_init__(self) -> None:
        self.progress = Reporter.of(self.progress)

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
        each = self.extensions.items()
        begun = [_label([*names, *added]) for names, e in each for added in e.untried]
        return (*begun, *(f'more with {_label(names)}' for names in self.front))

    @property
    def scanned(self) -> dict[Candidate, tuple[Array, ...]]:
        """Values of each effect that explained most on top of the model as given, best first."""
        return {s.candidate: s.begins for s in self.extensions[frozenset()].scans}

    @property
    def threshold(self) -> float:
        """Gain that noise alone can give [nats]."""
        limits = [e.threshold for e in self.extensions.values()]
        return max(self.settings.gates.least_nats, min(limits, default=0.0))

    def ordered(self) -> list[Scored]:
        """The best first."""
        return self.weight.ordered(list(self.known.values()))

    def add(self, sets: Iterable[Estimate]) -> None:
        """Score fitted sets; of two fits of one set the better is kept, and carried on anew."""
        for at in sets:
            mine = replace(score(at), ends=self.estimator.ends(at))
            other = self.known.get(at.names)
            saved = float((other.left - mine.left).sum()) if other else np.inf
            if other and saved > self.settings.gates.equal_nats * self.weight.spread:
                self.carried = {(n, near) for n, near in self.carried if near != at.names}
            if saved > 0:
                self.known[at.names] = mine

    def keep(self, at: Estimate) -> Scored:
        """A fitted set as it is known: this fit or a better one."""
        known = self.known.get(at.names)
        if known is None or known.at.fit is not at.fit:
            self.add([at])
        return self.known[at.names]

    def extend(self, names: Names, few: bool = False) -> None:
        """Find what one or two more effects do to a set.

        Where `few` are asked for these are single effects, and none that was fitted with the set
        already; but those with a whole number (the periods of a ripple), which may have been
        another.
        """
        pool = [c for c in self.pool if compatible(names, c)]
        if few:
            pool = [c for c in pool if names | {c} not in self.known or c.has_whole] or pool
        found = self.estimator.extended(self.known[names].at, pool, self.progress, few)
        self.extensions[names] = found
        self.add([found.base, *found.larger])

    def expect(self, front: Sequence[Names]) -> None:
        """Say about how much is to come: the sets to extend, as those before, and the end.

        At the beginning the catalogue says how much one is, and a first answer has neighbours.
        """
        numerics, pool = self.settings.numerics, len(self.pool)
        if self.extensions:
            rounds = len(front) * self.progress.clock.done // len(self.extensions)
        else:
            first = STEPS.round(pool, numerics.singles + numerics.first_pairs)
            each = STEPS.round(pool, numerics.singles + numerics.pairs)
            rounds = first + numerics.width * each
        self.progress.expect(rounds + STEPS.end)

    def add_parts(self, whole: Scored) -> bool:
        """Fit a set less one effect, for each of them, from its values; False where it was done.

        A part that was fitted from elsewhere may have come to rest in a worse place.
        """
        new = self.uncarried(_parts(whole), whole.names)
        self.add(self._part(n, whole.at) for n in new if not self.late)
        return bool(new)

    def add_part(self, names: Names, near: Estimate) -> None:
        """Fit a part of a set from its values, unless that was done."""
        self.add(self._part(n, near) for n in self.uncarried([names], near.names))

    def uncarried(self, sets: Iterable[Names], near: Names) -> list[Names]:
        """Those of some sets that were not fitted from the values of another one, and are now."""
        new = [] if self.late else [n for n in sets if (n, near) not in self.carried]
        self.carried |= {(n, near) for n in new}
        return new

    def _part(self, names: Names, near: Estimate) -> Estimate:
        full = near.fit.hypothesis
        part = Hypothesis(tuple(c for c in full.candidates if c in names), full.constants)
        return self.estimator.refitted(near, part, part.carried(full, near.fit.theta))


def _label(names: Iterable[Candidate]) -> str:
    return ' + '.join(c.label for c in names)


def compatible(names: Iterable[Candidate], other: Candidate) -> bool:
    """Whether an effect may stand with others: not what shares a term with one at its place."""

    def overlaps(one: Candidate) -> bool:
        everywhere = (
            EVERYWHERE in (one.where, other.where) and one.effect.hook == other.effect.hook
        )
        return one.where == other.where or everywhere

    return not any(overlaps(c) and _terms(c) & _terms(other) for c in names)


def _terms(candidate: Candidate) -> set[Parameter]:
    return {p for p in candidate.parameters if p.scales}


def best_of(sets: Sets) -> Scored:
    """The set that is chosen, once its parts and those of what looks better are fitted."""
    best = chosen(list(sets.known.values()), sets.weight, sets.threshold)
    for scored in sets.ordered()[: sets.settings.numerics.width]:
        if scored is best or sets.late:
            break
        if not sets.known.keys() >= {*_parts(scored)} and sets.add_parts(scored):
            return best_of(sets)
    return best


def best_ended(sets: Sets) -> Scored:
    """The set that is chosen of the model as given and those whose fits have come to their end.

    Its parts need not have come to theirs.
    """
    known = list(sets.known.values())
    ended = {s.names for s in known if s.fit.ended or not s.names}
    able = (s for s in _fitting(known, sets.weight, sets.threshold) if s.names in ended)
    return next(able, None) or sets.known[frozenset()]


def chosen(sets: Sequence[Scored], weight: Weight, limit: float) -> Scored:
    """The best of the sets whose every part predicts worse, beyond what noise and chance give.

    Of a set that takes part, each less one effect is in `sets` too. Noise alone can give an effect
    a gain of `limit` [nats].
    """
    best = next(_fitting(sets, weight, limit), None)
    return best or next(s for s in sets if not s.names)


def _fitting(sets: Sequence[Scored], weight: Weight, limit: float) -> Iterator[Scored]:
    return (s for s in weight.ordered(sets) if supported(sets, s, weight, limit))


def supported(sets: Sequence[Scored], scored: Scored, weight: Weight, limit: float) -> bool:
    """Whether every part of a set is known and surely predicts worse, and all of fewer effects do.

    What takes more effects to predict what fewer predict as well is no better answer, even where
    it saves more; unless it explains most of what the fewer leave.
    """
    if not {*_parts(scored)} <= {s.names for s in sets}:
        return False
    parts = [s for s in sets if s.size < scored.size and holds(scored, s)]
    fewer = [s for s in sets if len(s.names) < len(scored.names)]

    def matters(less: Scored) -> bool:
        return weight.tells_apart(less, scored) or weight.explains_most(less, scored)

    return all(weight.supports(s, scored, limit) for s in parts) and all(
        weight.saves(s, scored, limit) and matters(s) for s in fewer
    )


def _parts(scored: Scored) -> list[Names]:
    return [scored.names - {c} for c in scored.fit.hypothesis.candidates]


def holds(larger: Scored, smaller: Scored) -> bool:
    """Whether each effect of a set is in another one, itself or as part of a wider law there."""
    return all(any(c == d or widens(d, c) for d in larger.names) for c in smaller.names)


def widens(candidate: Candidate, other: Candidate) -> bool:
    """Whether an effect is a wider law than another one at the same place: Stribeck's, Coulomb's.

    Which of them it is, is no question of two causes.
    """
    return candidate.where == other.where and set(other.parameters) < set(candidate.parameters)


def distinct(ordered: Sequence[Scored], weight: Weight) -> list[Scored]:
    """The sets less those that do the same as the one before, by other names."""
    kept: list[Scored] = []
    for scored in ordered:
        if not kept or abs(weight.ahead(kept[-1], scored)) > weight.gates.equal_nats:
            kept.append(scored)
    return kept
