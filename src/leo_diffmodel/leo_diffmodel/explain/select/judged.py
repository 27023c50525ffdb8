# SPDX-License-Identifier: Apache-2.0
"""What is left of a set when folds have judged each of its effects."""

from __future__ import annotations

from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import linear_part
from leo_diffmodel.explain.estimate.rounds import ORDINARY
from leo_diffmodel.explain.problem.hypothesis import Candidate, widens
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.sets import Names, Sets


def judged(sets: Sets, at: Estimate) -> Scored:
    """The set of an estimate less its effects that folds do not support.

    It is fitted again where leaving out one of them costs more than noise gives: the others are
    then far from where they were linearised.
    """
    problem, whole = at.problem, at
    sets.keep(at)
    while not sets.late and (weak := _weakest(sets, at)):
        at = weak.at
        cost = at.fit.lost(problem.train) - whole.fit.lost(problem.train)
        if cost > sets.threshold * sets.weight.spread:
            at = whole = sets.estimator.refitted(at, at.fit.hypothesis, at.fit.theta)
    if at is whole or sets.late:
        return sets.keep(at)
    return judged(sets, sets.estimator.refitted(at, at.fit.hypothesis, at.fit.theta))


def usual(sets: Sets, at: Estimate) -> Names:
    """The losses that most joints have, in a set with those of every joint.

    What most joints have the others have too, whether data show it or not (exchangeable priors):
    left out, it would go into what is there.
    """
    mine, found = sets.keep(at), set()
    joints = len(at.problem.base.robot.actuators)
    for law in ORDINARY if joints >= sets.settings.gates.several else ():
        own = [c for c in at.fit.hypothesis.candidates if c.effect.name == law]
        worth = [c for c in own if sets.weight.saves(_part(sets, at, c), mine, sets.threshold)]
        if 2 * len(worth) > joints:
            found |= {*own}
    return frozenset(found)


def _weakest(sets: Sets, at: Estimate) -> Scored | None:
    """The set less the effect that is worth least, if this is not surely worth anything.

    Narrower laws, which have to be fitted, are tried where every effect is worth something.
    """
    mine = sets.keep(at)
    asked = [c for c in at.fit.hypothesis.candidates if c not in sets.usual]
    narrower = ((c, law) for c in at.names for law in sets.pool if widens(c, law))
    for parts in (
        (_part(sets, at, c) for c in asked),
        (_narrower(sets, at, *n) for n in narrower),
    ):
        weak = [part for part in parts if not _matters(sets, part, mine)]
        if weak:
            return min(weak, key=lambda part: sets.weight.ahead(mine, part))
    return None


def _part(sets: Sets, at: Estimate, out: Candidate) -> Scored:
    """A set less one effect, by its linear answer if it was not fitted, as of many or late."""
    names = at.names - {out}
    if len(at.names) <= sets.settings.gates.many:
        sets.add_part(names, at)
    if names not in sets.known:
        sets.add([at._replace(fit=linear_part(at.problem, at.fit, [out]))])
    return sets.known[names]


def _narrower(sets: Sets, at: Estimate, wide: Candidate, law: Candidate) -> Scored:
    """A set with a narrower law in the place of a wider one, fitted from its values."""
    names = at.names - {wide} | {law}
    if names not in sets.known:
        sets.add_from(at, [law if c == wide else c for c in at.fit.hypothesis.candidates])
    return sets.known[names]


def _matters(sets: Sets, part: Scored, whole: Scored) -> bool:
    """Whether a set predicts surely better than a part of it, and by what anybody can see."""
    supports = sets.weight.supports(part, whole, sets.threshold)
    return supports and sets.weight.matters(part, whole)
