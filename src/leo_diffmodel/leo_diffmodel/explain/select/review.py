# SPDX-License-Identifier: Apache-2.0
"""Review a set of effects: all candidates in each one's place, with the others kept.

A first pick may be a mixture of two effects that are missing together, and a name is only worth
as much as its distance from what else could stand there once everything else is in the model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.explain.decide.classes import Facts, same_thing
from leo_diffmodel.explain.decide.verdict import UNEXPLAINED_RATIO
from leo_diffmodel.explain.estimate.fit import Fit, fit, Problem, settled_as
from leo_diffmodel.explain.estimate.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.estimate.scan import amplitude_indices
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.select.ranking import gain, Round
from leo_diffmodel.explain.select.scored import (
    MARGIN_NATS,
    NEUTRAL_SIGMAS,
    Scored,
    shows,
    unexplained,
)

MOST_SWAPS = 4
FADED = 0.05
Explore = Callable[[Posed, Fit, Fit | None], Round]


@dataclass(frozen=True)
class Reviewed:
    """A set in which every effect holds its place.

    Attributes:
        final: the set, jointly fitted.
        members: the round of each effect: all candidates in its place.
        posed: the problem, with the noise as settled in the end.
        changed: an effect was dropped or gave way to another. One found last that went before
            one it made worthless does not count: the search would only find it again.
    """

    final: Fit
    members: Mapping[Candidate, Round]
    posed: Posed
    changed: bool


def review(
    posed: Posed, final: Fit, known: Mapping[Candidate, Round], explore: Explore
) -> Reviewed:
    """Let every effect defend its place; drop it or swap it where another does better.

    An effect gives way only to what leaves nothing, be that one effect in its place or all the
    others without it, and never to the same thing by another name that is no better: on a robot
    with much that no effect explains, each trifle fits best in its own way, and the order in which
    effects explain most is worth more. There the effect found last goes before one that it has
    made worthless. Two effects that do together what one does give way to the one; on the ground,
    where a first pick is made in few windows, all effects at one place are taken out at once to
    see whether one does.

    Args:
        posed: the problem.
        final: the set, jointly fitted.
        known: rounds already made with all the others kept.
        explore: tries all candidates on top of a fit; its last argument is the fit of the set.
    """
    if posed.problem.footing and (one := as_one(posed, final, explore)):
        assert one.best and one.best.fit
        again = review(one.posed, one.best.fit, {one.best.candidate: one}, explore)
        return replace(again, changed=True)
    members, swaps, changed = dict(known), 0, False
    while True:
        stale = [c for c in final.hypothesis.candidates if c not in members]
        if not stale:
            return Reviewed(final, members, posed, changed)
        index = final.hypothesis.candidates.index(stale[0])
        found = explore(posed, without(posed.problem, final, index), final)
        posed, best = found.posed, found.best
        if best is None or best.fit is None:
            last = len(final.hypothesis.candidates) - 1
            given_way = index == last or _completes(found.null)
            final = found.null if given_way else without(posed.problem, final, last)
            members, changed = {}, changed or given_way
        elif swaps < MOST_SWAPS and (
            fewer := _fewer(posed.problem, final, stale[0], found)
        ):
            final, members, changed = fewer, {}, True
            swaps += 1
        elif (
            _holds(posed.problem, found, stale[0])
            or swaps == MOST_SWAPS
            or not _completes(best.fit)
        ):
            members[stale[0]] = found
            if swaps < MOST_SWAPS and (better := _recovered(final, stale[0], found)):
                final, members, changed = better, {stale[0]: found}, True
                swaps += 1
        else:
            final, members, changed = best.fit, {best.candidate: found}, True
            swaps += 1


def as_one(posed: Posed, final: Fit, explore: Explore) -> Round | None:
    """One effect that does as well as several that were found at one place.

    Args:
        posed: the problem.
        final: the set, jointly fitted.
        explore: tries all candidates on top of a fit.

    Returns:
        The round without those, whose best is the one, wherever it acts; None where there is none.
    """
    places = [c.where for c in final.hypothesis.candidates]
    for where in sorted({w for w in places if places.count(w) > 1}):
        rest = final
        for c in (c for c in final.hypothesis.candidates if c.where == where):
            rest = without(posed.problem, rest, rest.hypothesis.candidates.index(c))
        found = explore(posed, rest, None)
        if found.best and found.best.fit and _stands_for(found.best, found.posed.problem, final):
            return found
    return None


def _stands_for(best: Scored, problem: Problem, final: Fit) -> bool:
    """Whether a set with one effect leaves as little as one with several, parameters counted."""
    one = best.fit
    assert one
    if problem.footing:
        final = settled_as(problem, final, one)
    more = max(one.hypothesis.size - final.hypothesis.size, 0)
    price = 0.5 * more * float(np.log(final.residual.size))
    return _completes(one) and _behind(problem, one, final, best.dispersion) + price < MARGIN_NATS


def _holds(problem: Problem, found: Round, member: Candidate) -> bool:
    """Whether a member is the best in its place, or the same thing in any data and as good."""
    assert found.best
    mine, best = found.of(member), found.best
    free = bool((problem.windows.enabled < 0.5).any())
    same = same_thing(best.candidate, member, Facts(problem.base.robot, free))
    as_good = mine.fit is not None and best.score - mine.score < MARGIN_NATS
    return best.candidate == member or (same is not None and as_good)


def _recovered(final: Fit, member: Candidate, found: Round) -> Fit | None:
    """The set with a member as a round on the ground fitted it, where that is far better.

    Only for a member with a parameter that did not show at its values.
    """
    mine, problem = found.of(member), found.posed.problem
    if not problem.footing or mine.fit is None or shows(final, member):
        return None
    lost = _behind(problem, settled_as(problem, final, mine.fit), mine.fit, mine.dispersion)
    return mine.fit if lost > MARGIN_NATS else None


def _fewer(problem: Problem, final: Fit, member: Candidate, found: Round) -> Fit | None:
    """The set less one effect, where what is as good in a member's place has no need of it."""
    best, constants = found.scored[0], final.hypothesis.constants
    for rival in found.scored:
        full = rival.fit
        if full is None or best.score - rival.score > MARGIN_NATS:
            continue
        taken = [rival.candidate if c == member else c for c in final.hypothesis.candidates]
        for other in taken:
            if other != rival.candidate and _fades(final, full, other):
                fewer = Hypothesis(tuple(c for c in taken if c != other), constants)
                theta = fewer.carried(full.hypothesis, full.theta)
                fitted = fit(problem, fewer, theta, full.start)
                lost = _behind(problem, fitted, full, best.dispersion)
                if lost < MARGIN_NATS and _completes(fitted):
                    return fitted
    return None


def _behind(problem: Problem, fitted: Fit, other: Fit, spread: float) -> float:
    """Nats that a fit is behind another, in residuals of that dispersion."""
    return gain(fitted, other, problem.train, spread if problem.footing else np.inf) / spread


def _fades(before: Fit, after: Fit, candidate: Candidate) -> bool:
    """Whether little is left of an effect in another set, or nothing that is sure."""
    was, now = _away(before, candidate), _away(after, candidate)
    sure = np.sqrt(np.diagonal(after.covariance))[_scaling(after, candidate)]
    return bool(np.all(now < np.maximum(FADED * was, NEUTRAL_SIGMAS * sure)))


def _away(fitted: Fit, candidate: Candidate) -> np.ndarray:
    """How far from neutral all is that scales an effect."""
    return np.abs(fitted.theta - fitted.hypothesis.neutral)[_scaling(fitted, candidate)]


def _scaling(fitted: Fit, candidate: Candidate) -> list[int]:
    first = fitted.hypothesis.offset(fitted.hypothesis.candidates.index(candidate))
    return [first + i for i in amplitude_indices(candidate.parameters)]


def _completes(swapped: Fit) -> bool:
    """Whether only noise is left; of sets that all leave more, what was found first stays."""
    return unexplained(swapped) < UNEXPLAINED_RATIO


def without(problem: Problem, full: Fit, index: int) -> Fit:
    """The set less its effect at `index`, refitted."""
    smaller = full.hypothesis.without(index)
    return fit(problem, smaller, smaller.carried(full.hypothesis, full.theta), full.start)
