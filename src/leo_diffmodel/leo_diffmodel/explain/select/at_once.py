# SPDX-License-Identifier: Apache-2.0
"""All effects at once: rounds in short windows, then all sets near what these lead to.

What folds do not support leaves the set. Then all sets with one effect more, or with one in the
place of one or two, are compared by linear algebra, the best of them fitted, and so on until none
of them is better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.estimate.background import background
from leo_diffmodel.explain.estimate.estimator import Estimate, Extension, STEPS
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import dispersion, Fit
from leo_diffmodel.explain.estimate.matrices import Matrices
from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.select.choice import rivals
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.judged import judged
from leo_diffmodel.explain.select.rounds import price_of, Rounds
from leo_diffmodel.explain.select.sets import chosen, EVERYWHERE, Sets


def searched_at_once(
    sets: Sets, first: Estimate, recordings: Sequence[Recording], near: Fit | None = None
) -> Scored:
    """The set that is chosen when all effects are heard together.

    Where the time is over it is the best so far.

    Args:
        sets: takes what is fitted.
        first: the model as given.
        recordings: all of them, for shorter windows.
        near: what was chosen with a longer integration step, where the search began.
    """
    everywhere = {c.effect.name for c in sets.pool if c.where != EVERYWHERE}
    pool = [c for c in sets.pool if c.where != EVERYWHERE or c.effect.name not in everywhere]
    sets.progress.expect(2 * len(pool) + STEPS.end)
    rounds = Rounds(sets, first, pool)
    sets.add([first])
    begun = near or rounds.begun(recordings)
    fitted = fit(first.problem, begun.hypothesis, begun.theta)
    sets.progress('all losses at once', STEPS.fit)
    fitted, made = rounds.settled(first.problem, fitted)
    best = judged(sets, rounds.seen(first._replace(fit=fitted), made))
    best, made = _Neighbours(sets, rounds, pool).best(best, made)
    scans = (*made.scans, *_scans(made, begun))
    known = sets.extensions.get(frozenset())
    if known:
        scans = known.scans
    sets.extensions[frozenset()] = Extension(first, (), scans, made.threshold)
    sets.front = (best.names,) if sets.late else ()
    sets.background = background(made, [*best.names], max(dispersion(best.fit), 1.0))
    return best


class _Neighbours:
    """Sets near others."""

    def __init__(self, sets: Sets, rounds: Rounds, pool: Sequence[Candidate]):
        self._sets, self._rounds, self._pool = sets, rounds, pool
        self._judged: dict[int, Fit] = {}

    def best(self, best: Scored, made: Matrices) -> tuple[Scored, Matrices]:
        """The best of all sets near it, and its matrices."""
        sets = self._sets
        if len(best.names) <= sets.settings.gates.many:
            self._fit_near(sets.known[frozenset()])
            best = self._chosen()
        while not sets.late and best.names not in sets.extensions:
            made = self._fit_near(best)
            best = self._chosen()
        best = self._shared(best)
        if {t.candidate for t in made.members} != best.names:
            made = self._rounds.matrices(best.at.problem, best.fit)
        return best, made

    def _shared(self, best: Scored) -> Scored:
        """The best set with one value at all joints, where that predicts as well."""
        sets = self._sets
        for shared in [c for c in sets.pool if c not in self._pool]:
            own = [c for c in best.names if c.effect.name == shared.effect.name]
            if not own or sets.late:
                continue
            full, fitted = best.fit.hypothesis, best.fit
            rest = [c for c in full.candidates if c not in own]
            value = np.mean([fitted.own(c) for c in own], axis=0)
            constants = fitted.theta[full.first_constant :]
            theta = np.concatenate([*map(fitted.own, rest), value, constants])
            part = replace(full, candidates=(*rest, shared))
            at = sets.estimator.refitted(best.at, part, theta)
            sets.add([at])
            judged(sets, at)
            best = self._chosen()
        return best

    def _chosen(self) -> Scored:
        """What folds leave of the best sets there are."""
        sets = self._sets
        best = sets.ordered()[: sets.settings.numerics.width]
        while not sets.late and (new := [s for s in best if id(s.fit) not in self._judged]):
            self._judged[id(new[0].fit)] = new[0].fit
            judged(sets, new[0].at)
            best = sets.ordered()[: sets.settings.numerics.width]
        return chosen([*sets.known.values()], sets.weight, sets.threshold)

    def _fit_near(self, at: Scored) -> Matrices:
        """Fit the sets near one that promise most."""
        sets, problem = self._sets, at.at.problem
        made = self._rounds.matrices(problem, at.fit)
        sets.extensions[at.names] = Extension(at.at, (), made.scans, made.threshold)
        near = sets.settings.gates.told_nats * max(dispersion(at.fit), 1.0)
        price = price_of(problem, at.fit, made)
        for terms in rivals(made, price, sets.settings, near):
            if sets.late:
                break
            hypothesis, theta = made.hypothesis(terms)
            best = min(s.fit.lost(problem.train) for s in sets.known.values())
            sets.add([sets.estimator.refitted(at.at, hypothesis, theta, best)])
            sets.progress(' + '.join(c.label for c in hypothesis.candidates), STEPS.fit)
        return made


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
