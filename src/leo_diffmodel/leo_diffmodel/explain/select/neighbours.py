# SPDX-License-Identifier: Apache-2.0
"""The search: from where it begins to the best set near each best set, until none is better.

Of each of the best sets, effects that the folds do not support are taken out.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import Fit, linear_part
from leo_diffmodel.explain.estimate.rounds import ORDINARY
from leo_diffmodel.explain.problem.hypothesis import Candidate, EVERYWHERE, widens
from leo_diffmodel.explain.select.evidence import score, Scored
from leo_diffmodel.explain.select.sets import chosen, Names, Sets


def searched(
    sets: Sets, first: Estimate, recordings: Recordings, near: Fit | None = None
) -> Scored:
    """The set that is chosen once all near it are known; the best so far if the time is over.

    Where few effects are enough, others as few may do as well: they are looked for about the
    model as given (`first`), too. `near` is what was chosen with a longer integration step, where
    the search begins.
    """
    sets.add([first])
    hear = partial(sets.hear, first)
    begun = sets.estimator.begun(first, recordings, sets.pool, sets.progress, near, hear)
    sets.usual = _usual(sets, begun)
    best = judged(sets, begun)
    hear(best.at)
    if len(best.names) <= sets.settings.gates.many:
        sets.extend(frozenset())
        best = _best(sets)
    while best.names not in sets.extensions:
        sets.extend(best.names)
        best = _best(sets)
        hear(best.at)
        if sets.late:
            break
    return sets.ordered()[0] if sets.late else _shared(sets, best)


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


def _usual(sets: Sets, at: Estimate) -> Names:
    """The losses that most joints have, in a set with those of every joint.

    What most joints have the others have too, whether data show it or not (exchangeable priors):
    left out, it would go into what is there.
    """
    whole, found = sets.keep(at), set()
    joints = len(at.problem.base.robot.actuators)
    for law in ORDINARY if joints >= sets.settings.gates.several else ():
        losses = [c for c in at.fit.hypothesis.candidates if c.effect.name == law]
        parts = {c: score(_without(at, c)) for c in losses}
        worth = [c for c in losses if sets.weight.saves(parts[c], whole, sets.threshold)]
        if 2 * len(worth) > joints:
            found |= {*losses}
    return frozenset(found)


def _weakest(sets: Sets, at: Estimate) -> Scored | None:
    """The set less the effect that is worth least, if this is not surely worth anything.

    Narrower laws, which have to be fitted, are tried where every effect is worth something.
    """
    whole = sets.keep(at)
    asked = [c for c in at.fit.hypothesis.candidates if c not in sets.usual]
    narrower = ((c, law) for c in at.names for law in sets.pool if widens(c, law))
    for parts in (
        (_part(sets, at, c) for c in asked),
        (_narrower(sets, at, *n) for n in narrower),
    ):
        weak = [part for part in parts if not _matters(sets, part, whole)]
        if weak:
            return min(weak, key=lambda part: sets.weight.ahead(whole, part))
    return None


def _part(sets: Sets, at: Estimate, out: Candidate) -> Scored:
    """A set less one effect, by its linear answer if it was not fitted, as of many or late."""
    names = at.names - {out}
    if len(at.names) <= sets.settings.gates.many:
        sets.add_part(names, at)
    if names not in sets.known:
        sets.add([_without(at, out)])
    return sets.known[names]


def _without(at: Estimate, out: Candidate) -> Estimate:
    return at._replace(fit=linear_part(at.problem, at.fit, [out]))


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


def _best(sets: Sets) -> Scored:
    """The set that is chosen, once the best ones are judged.

    Losses that most joints need no more beside what is found now are usual no more.
    """
    width = sets.settings.numerics.width
    while not sets.late and (
        new := [s for s in sets.ordered()[:width] if id(s.fit) not in sets.judged]
    ):
        sets.judged[id(new[0].fit)] = new[0].fit
        judged(sets, new[0].at)
    best = chosen([*sets.known.values()], sets.weight, sets.threshold)
    if sets.late or not sets.usual:
        return best
    laws = {c.effect.name for c in _usual(sets, best.at)}
    usual = frozenset(c for c in sets.usual if c.effect.name in laws)
    if usual == sets.usual:
        return best
    sets.usual, sets.judged = usual, {}
    return _best(sets)


def _shared(sets: Sets, best: Scored) -> Scored:
    """The best set with one value at all joints, where that predicts as well."""
    for candidate in [c for c in sets.pool if c.where == EVERYWHERE]:
        joints = sum(c.effect.name == candidate.effect.name for c in sets.pool) - 1
        if not sets.late and _agree(best.fit, candidate, joints, sets.settings.numerics.agree):
            judged(sets, _with_shared(sets, best, candidate))
            best = _best(sets)
    return best


def _with_shared(sets: Sets, best: Scored, candidate: Candidate) -> Estimate:
    """A set with the mean of its values of an effect at joints as one value at all."""
    fitted, full = best.fit, best.fit.hypothesis
    rest = [c for c in full.candidates if c.effect.name != candidate.effect.name]
    values = [fitted.own(c) for c in full.candidates if c not in rest]
    constants = fitted.theta[full.first_constant :]
    theta = np.concatenate([*map(fitted.own, rest), np.mean(values, axis=0), constants])
    part = replace(full, candidates=(*rest, candidate))
    return sets.estimator.refitted(best.at, part, theta)


def _agree(fitted: Fit, shared: Candidate, joints: int, most: float) -> bool:
    """Whether half the joints have an effect, and of one value as far as their errors say."""
    full = fitted.hypothesis
    held = [(n, c) for n, c in enumerate(full.candidates) if c.effect.name == shared.effect.name]
    if not 2 * len(held) >= joints > 0 or any(c.where == EVERYWHERE for _, c in held):
        return False
    spans = [slice(full.offset(n), full.offset(n + 1)) for n, _ in held]
    values = np.array([fitted.theta[s] for s in spans])
    errors = np.array([fitted.standard_errors[s] for s in spans]) + 1e-12
    apart = np.abs(values - np.average(values, axis=0, weights=errors**-2)) / errors
    return bool(apart.max() < most)
