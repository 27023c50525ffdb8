# SPDX-License-Identifier: Apache-2.0
"""The search: from the model as given to better and better sets, until no neighbour is better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.sets import (
    best_of,
    compatible,
    distinct,
    EVERYWHERE,
    Names,
    Sets,
    widens,
)

Array = np.ndarray


def searched(sets: Sets, first: Estimate) -> Scored:
    """The set that is chosen once all its neighbours are known, or the time is over."""
    sets.add([first])
    while front := _front(sets):
        if sets.late and sets.extensions:
            sets.front = tuple(front)
            break
        sets.expect(front)
        sets.extend(front[0], few=front[0] < best_of(sets).names and bool(front[0]))
    return best_of(sets)


def _front(sets: Sets) -> list[Names]:
    """The sets to extend: the best, others of its size, its parts, if they are not extended.

    Others that predict the same as the best are no other beginning, and where the best leaves no
    more than noise can give, no set of one more effect is better. Where all are extended, the best
    set with a value of its own at each joint may be one.
    """
    if frozenset() not in sets.extensions:
        return [frozenset()]
    best = _settled(sets)
    held = best.fit.hypothesis.candidates
    done = sets.weight.leaves_noise(best, sets.threshold)
    others = [] if done else _others(sets, best)
    near = [s.names for s in others[: sets.settings.numerics.width - 1]]
    parts = [best.names - {c} for c in held]
    first = [] if _same_begun(sets, best) else [best.names]
    small = [n for n in (*first, *near, *parts) if len(n) < sets.settings.gates.most_effects]
    front = [n for n in small if n not in sets.extensions]
    split = not front and any(_split(sets, best, c) for c in held)
    return _front(sets) if split else front


def _settled(sets: Sets) -> Scored:
    """The best set, once all near it are fitted from its values."""
    while True:
        best = best_of(sets)
        held = best.fit.hypothesis.candidates
        others = [_widened(sets, best, c) or _renumbered(sets, best, c) for c in held]
        if not any((sets.add_parts(best), _add_rivals(sets, best), *others)):
            return best


def _others(sets: Sets, best: Scored) -> list[Scored]:
    """Sets of as many effects as the best that predict something else, the best of them first."""
    ordered = distinct(sets.ordered(), sets.weight)
    others = [s for s in ordered if s.names and len(s.names) == len(best.names)]
    return [s for s in others if s is not best and sets.weight.tells_apart(best, s)]


def _same_begun(sets: Sets, best: Scored) -> bool:
    """Whether a set is extended that does the same as the best by as many other names."""
    weight, near = sets.weight, sets.settings.gates.margin_nats
    begun = (sets.known[n] for n in sets.extensions if len(n) == len(best.names))
    return any(
        abs(weight.ahead(best, s)) < near and not weight.tells_apart(best, s) for s in begun
    )


def _add_rivals(sets: Sets, best: Scored) -> bool:
    """Fit again, from the values of a set, the best that have one effect in the place of one.

    What was fitted from elsewhere may have come to rest in a worse place. False where nothing is
    new.
    """
    size = len(best.names)
    if size < 2 and not best.fit.hypothesis.constants:
        return False
    rivals = {
        s.names: s.fit
        for s in sets.ordered()
        if len(s.names) == size == len(s.names & best.names) + 1
    }
    near = [*rivals][: sets.settings.numerics.singles]
    new = sets.uncarried(near, best.names)
    sets.add(_rival(sets, rivals[n], best.at) for n in new if not sets.late)
    return bool(new)


def _rival(sets: Sets, rival: Fit, near: Estimate) -> Estimate:
    best, mine = near.fit, rival.hypothesis
    own = [(best if c in near.names else rival).own(c) for c in mine.candidates]
    theta = np.concatenate([*own, best.theta[best.hypothesis.first_constant :]])
    return sets.estimator.refitted(near, mine, theta, best.lost(near.problem.train))


def _split(sets: Sets, best: Scored, candidate: Candidate) -> bool:
    """A value of its own at each joint instead of a shared one; False where nothing is new."""
    name = candidate.effect.name
    if candidate.where != EVERYWHERE or candidate.effect.late or sets.late:
        return False
    of_joint = [c for c in sets.pool if c.effect.name == name and c.where != EVERYWHERE]
    own = [c for c in of_joint if c not in best.names]
    if len(own) < 2 or best.names - {candidate} | set(own) in sets.known:
        return False
    _put(sets, best, candidate, own, [best.fit.own(candidate)] * len(own))
    return True


def _widened(sets: Sets, best: Scored, candidate: Candidate) -> bool:
    """Wider laws in an effect's place, from its values; False where nothing is new.

    What else such a law has begins as a scan found it. The fit of a law with three parameters that
    begins far away may come to rest behind that of the law with one that is part of it.
    """
    own, others, full = sets.scanned, best.names - {candidate}, best.fit.hypothesis
    narrow = full.values(best.fit.theta, full.candidates.index(candidate))
    laws = {others | {c}: c for c in own if widens(c, candidate) and compatible(others, c)}
    new = [laws[n] for n in sets.uncarried(laws, best.names)]
    for wide in new:
        for scanned in own[wide][: sets.settings.numerics.begins]:
            pairs = zip(wide.parameters, scanned, strict=True)
            values = np.array([narrow.get(p.name, value) for p, value in pairs])
            _put(sets, best, candidate, [wide], [values])
    return bool(new)


def _renumbered(sets: Sets, best: Scored, candidate: Candidate) -> bool:
    """The whole number of an effect (periods of a ripple) one more and one less, as scanned."""
    whole = [i for i, p in enumerate(candidate.parameters) if p.whole]
    if not whole:
        return False
    own = best.fit.own(candidate)
    near = (b for b in sets.scanned.get(candidate, ()) if np.abs(b - own)[whole].max() == 1)
    new = [b for b in near if (best.names, candidate, *b[whole]) not in sets.numbers]
    new = [] if sets.late else new
    sets.numbers |= {(best.names, candidate, *b[whole]) for b in (own, *new)}
    for values in new:
        _put(sets, best, candidate, [candidate], [values])
    return bool(new)


def _put(
    sets: Sets, best: Scored, old: Candidate, new: Sequence[Candidate], values: Sequence[Array]
) -> None:
    """Fit the best set with others in the place of an effect, from its values and these."""
    full, theta = best.fit.hypothesis, best.fit.theta
    rest: Hypothesis = full.without(full.candidates.index(old))
    kept, split = rest.carried(full, theta), rest.first_constant
    other = replace(rest, candidates=(*rest.candidates, *new))
    begin = np.concatenate([kept[:split], *values, kept[split:]])
    sets.add([sets.estimator.refitted(best.at, other, begin)])
