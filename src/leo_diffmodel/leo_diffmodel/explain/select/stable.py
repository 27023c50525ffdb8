# SPDX-License-Identifier: Apache-2.0
"""How sure a choice is: ties that longer windows break, and what stays where folds are left out.

Stability selection (Meinshausen and Bühlmann 2010) asks of each effect how often it is chosen. It
is there by any name, in a wider law, or in a law of all joints. Where a wider law is not chosen in
enough of the resamples and a narrower one in it is, the narrower one is the answer.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.problem.hypothesis import Candidate, EVERYWHERE, widens
from leo_diffmodel.explain.select.evidence import score, Scored, weigh, Weight
from leo_diffmodel.explain.select.sets import chosen, Names, Sets, supported

Alike = Callable[[Candidate, Candidate], bool]
"""Whether two effects are one, or the same thing in the data."""


def long_horizon_tie_break(sets: Sets, best: Scored) -> Scored:
    """Of sets that short windows cannot tell apart, the best in the longest that can be fitted.

    Not of more than `many` effects, where held-out errors alone have the last word.
    """
    longer, weight, margin = best.at.posed.longer, sets.weight, sets.settings.gates.margin_nats
    size, able = len(best.names), sets.all_supported()
    near = [s for s in able if len(s.names) == size and weight.ahead(best, s) < margin]
    if longer is None or len(near) < 2 or size > sets.settings.gates.many:
        return best
    near = _distinct(weight.ordered(near), weight)[: sets.settings.numerics.singles]
    if len(near) < 2:
        return best
    posed = replace(best.at.posed, problem=longer)
    again = [score(Estimate(posed, fit(longer, s.fit.hypothesis, s.fit.theta))) for s in near]
    judge = weigh(again)
    first = judge.ordered(again)[0]
    for scored in again:
        known = sets.known[scored.names]
        sets.known[scored.names] = replace(known, behind=judge.ahead(first, scored))
    return sets.known[first.names]


def _distinct(ordered: Sequence[Scored], weight: Weight) -> list[Scored]:
    """The sets less those that do the same as the one before, by other names."""
    kept: list[Scored] = []
    for scored in ordered:
        if not kept or abs(weight.ahead(kept[-1], scored)) > weight.gates.equal_nats:
            kept.append(scored)
    return kept


def canonical(sets: Sets, best: Scored) -> Scored:
    """Of sets that do as well with as many parameters, the one of fewest effects.

    Then the one whose names come first in the catalogue.
    """
    order, weight = {c: n for n, c in enumerate(sets.pool)}, sets.weight
    near, able = sets.settings.gates.equal_nats, sets.all_supported()
    alike = [s for s in able if s.size == best.size and abs(weight.ahead(best, s)) <= near]

    def rank(scored: Scored) -> tuple[int, list[int]]:
        return len(scored.names), sorted(order[c] for c in scored.names)

    return min(alike, key=rank, default=best)


def resamples(sets: Sets) -> list[Scored]:
    """What is chosen when folds at random are left out of the choice, again and again.

    Folds are left out, not windows: what two windows of one recording have in common would else
    decide (delete-d jackknife, Shao and Wu 1989).
    """
    known, weight, gates = list(sets.known.values()), sets.weight, sets.settings.gates
    folds, rng = np.unique(known[0].fold), np.random.default_rng(0)
    kept = len(folds) - max(1, round(len(folds) * gates.left_out))
    draws = [rng.permutation(folds)[:kept] for _ in range(gates.turns)]
    limit = sets.threshold * kept / len(folds)
    return [chosen(known, replace(weight, folds=np.sort(d)), limit) for d in draws]


def part_of(candidate: Candidate, other: Candidate) -> bool:
    """Whether an effect is in another: a law of one joint in that of all, or in a wider one."""
    # the bounds of parameters may differ from joint to joint
    own, its = ({(p.name, p.unit) for p in c.parameters} for c in (candidate, other))
    return (
        other.where in (candidate.where, EVERYWHERE)
        and candidate.effect.hook == other.effect.hook
        and (candidate.effect.name == other.effect.name or own < its)
    )


def has(names: Iterable[Candidate], candidate: Candidate, alike: Alike) -> bool:
    """Whether a set has an effect, the same thing by another name, or something that contains it.

    Two effects may do what one does for all joints.
    """
    return any(alike(c, candidate) or part_of(candidate, c) for c in names)


def share(resamples: Sequence[Names], candidates: Iterable[Candidate], alike: Alike) -> float:
    """Share of the resamples that hold all of some effects."""
    wanted = list(candidates)
    return float(np.mean([all(has(names, c, alike) for c in wanted) for names in resamples]))


def narrowed(found: Sets, best: Scored, resamples: Sequence[Names], alike: Alike) -> Scored:
    """The chosen set, wider laws given way to narrower ones where only those stay."""
    names = frozenset(_narrowed(found, c, resamples, alike) for c in best.names)
    if names == best.names:
        return best
    if names not in found.known:
        found.add_from(best.at, [c for c in found.pool if c in names])
    found.add_parts(found.known[names])
    narrow, known = found.known[names], list(found.known.values())
    return narrow if supported(known, narrow, found.weight, found.threshold) else best


def _narrowed(found: Sets, wide: Candidate, resamples: Sequence[Names], alike: Alike) -> Candidate:
    """The effect, or the widest law in it that enough resamples hold where they do not hold it."""
    narrower = [c for c in found.pool if widens(wide, c)]
    laws = [wide, *sorted(narrower, key=lambda c: -len(c.parameters))]
    stable = found.settings.gates.stable
    return next((c for c in laws if share(resamples, [c], alike) >= stable), wide)
