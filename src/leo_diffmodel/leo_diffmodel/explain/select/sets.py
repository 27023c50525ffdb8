# SPDX-License-Identifier: Apache-2.0
"""Sets of effects that were fitted, and the one that is chosen: each part of it predicts worse."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
import time

import numpy as np

from leo_diffmodel.explain.estimate import estimator as estimating
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis, widens
from leo_diffmodel.explain.select.evidence import score, Scored, weigh, Weight
from leo_diffmodel.explain.settings import Settings
from leo_msgs_py.console import listed, Reporter

Names = frozenset[Candidate]


@dataclass
class Sets:
    """All sets that were fitted, and the extensions that led to them."""

    estimator: estimating.Estimator
    pool: Sequence[Candidate]  # all candidates, in the order of the catalogue
    settings: Settings
    progress: Reporter
    hear: estimating.Hear = lambda *_: None  # is told each better set
    until: float = np.inf  # when to stop [s of `time.monotonic`]
    known: dict[Names, Scored] = field(default_factory=dict)
    extensions: dict[Names, estimating.Extension] = field(
        default_factory=dict
    )  # tried on top of which set
    usual: Names = frozenset()  # losses that are in every hypothesis, since most joints have them
    carried: set[tuple[Names, Names]] = field(default_factory=set)  # which was fitted from which
    judged: dict[int, Fit] = field(default_factory=dict)  # by their identity

    @property
    def weight(self) -> Weight:
        """What a nat counts, by the best set so far."""
        return weigh(list(self.known.values()), self.estimator.most_nats, self.usual)

    @property
    def late(self) -> bool:
        return time.monotonic() > self.until

    @property
    def untried(self) -> tuple[str, ...]:
        sets = (added for e in self.extensions.values() for added in e.untried)
        return tuple(dict.fromkeys(' + '.join(c.label for c in added) for added in sets))

    @property
    def scans(self) -> tuple[Scan, ...]:
        """What each effect promises on the model as given, or beside the first set extended."""
        first = next(iter(self.extensions.values()), None)
        begun = self.extensions.get(frozenset(), first)
        return begun.scans if begun else ()

    @property
    def threshold(self) -> float:
        """Gain that noise alone can give [nats]."""
        limits = [e.threshold for e in self.extensions.values()]
        return max(self.settings.gates.least_nats, min(limits, default=0.0))

    def ordered(self) -> list[Scored]:
        return self.weight.ordered(list(self.known.values()))

    def all_supported(self) -> list[Scored]:
        """Those of which every part predicts worse."""
        known, weight, limit = list(self.known.values()), self.weight, self.threshold
        return [s for s in known if supported(known, s, weight, limit)]

    def add(self, sets: Iterable[estimating.Estimate]) -> None:
        """Score fitted sets; of two fits of one set the better is kept, others begin from it."""
        for at in sets:
            new = replace(score(at), ends=self.estimator.ends(at))
            self.progress('effects that are not needed', 1, estimating.PART)
            other = self.known.get(at.names)
            saved = float((other.left - new.left).sum()) if other else np.inf
            if other and saved > self.settings.gates.equal_nats * self.weight.spread:
                self.carried = {(n, near) for n, near in self.carried if near != at.names}
            if saved > 0:
                self.known[at.names] = new

    def keep(self, at: estimating.Estimate) -> Scored:
        """A fitted set as it is known: this fit or a better one."""
        known = self.known.get(at.names)
        if known is None or known.at.fit is not at.fit:
            self.add([at])
        return self.known[at.names]

    def extend(self, names: Names) -> None:
        """Fit the sets near one that promise most; say what there was no time for."""
        at = self.known[names].at
        if self.late:
            untried = tuple((c,) for c in self.pool)
            least = self.settings.gates.least_nats
            self.extensions[names] = estimating.Extension(at, (), (), least, untried)
            return
        numerics, rounds = self.settings.numerics, 1 if self.extensions else 2
        self.progress.expect(estimating.steps_ahead(numerics, len(self.pool), rounds))
        rival = min(s.fit.lost(at.problem.train) for s in self.known.values())
        found = self.estimator.near(at, self.pool, self.progress, rival)
        self.extensions[names] = found
        self.add([found.base, *found.larger])

    def add_parts(self, whole: Scored) -> None:
        """Fit a set less one effect, for each of them, from its values."""
        for candidate in whole.fit.hypothesis.candidates:
            self.add_part(whole.names - {candidate}, whole.at)

    def add_part(self, names: Names, near: estimating.Estimate) -> None:
        """Fit a part of a set from its values, unless that was done.

        A part that was fitted from elsewhere may have come to rest in a worse place.
        """
        if not self.late and (names, near.names) not in self.carried:
            self.carried.add((names, near.names))
            self.add_from(near, [c for c in near.fit.hypothesis.candidates if c in names])

    def add_from(self, near: estimating.Estimate, candidates: Sequence[Candidate]) -> None:
        """Fit a set from the values of one that has its effects, or wider laws of them."""
        full, theta = near.fit.hypothesis, near.fit.theta
        held, begin = full.candidates, []
        for c in candidates:
            law = c if c in held else next(wider for wider in held if widens(wider, c))
            values = full.values(theta, held.index(law))
            begin += [values[p.name] for p in c.parameters]
        begin += theta[full.first_constant :].tolist()
        part = Hypothesis(tuple(candidates), full.constants)
        fitted = self.estimator.refitted(near, part, np.array(begin))
        self.progress(listed([c.label for c in candidates]), 1, estimating.FIT)
        self.add([fitted])


def chosen(sets: Sequence[Scored], weight: Weight, limit: float) -> Scored:
    """The best of the sets whose every part predicts worse, beyond what noise and chance give.

    Of a set that takes part, each less one effect is in `sets` too. Noise alone can give an effect
    a gain of `limit` [nats].
    """
    able = (s for s in weight.ordered(sets) if supported(sets, s, weight, limit))
    return next(able, None) or next(s for s in sets if not s.names)


def supported(sets: Sequence[Scored], scored: Scored, weight: Weight, limit: float) -> bool:
    """Whether every part of a set is known and surely predicts worse, and all simpler sets do.

    What takes more effects to predict what fewer, of no more parameters, predict as well is no
    better answer, even where it saves more; unless it explains most of what those leave. Whether
    usual losses are there is no question.
    """
    asked = [scored.names - {c} for c in scored.names - weight.usual]
    if not {*asked} <= {s.names for s in sets}:
        return False
    usual = scored.names & weight.usual
    alike = [s for s in sets if s.names & weight.usual == usual]
    parts = [s for s in alike if s.size < scored.size and holds(scored, s)]
    fewer = [s for s in alike if len(s.names) < len(scored.names) and s.size <= scored.size]

    return all(weight.supports(s, scored, limit) for s in parts) and all(
        weight.saves(s, scored, limit) and weight.matters(s, scored) for s in fewer
    )


def holds(larger: Scored, smaller: Scored) -> bool:
    """Whether each effect of a set is in another one, itself or as part of a wider law there."""
    return all(any(c == d or widens(d, c) for d in larger.names) for c in smaller.names)
