# SPDX-License-Identifier: Apache-2.0
"""Is something missing that no known effect is?

A law joins the sets of named effects as one effect more, alone or with those that were chosen,
and is judged as they are: by what it predicts of the folds that are left out of it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.explain.estimate import trials
from leo_diffmodel.explain.estimate.estimator import Estimate, FIT, Progress
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit, rest_of
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.select.evidence import Scored, weigh
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.select.sets import Names, supported
from leo_diffmodel.explain.unknown.attempt import Attempt, attempt, joined, scored
from leo_diffmodel.explain.unknown.curves import Curve, curves, paths
from leo_diffmodel.explain.unknown.influence import Influence, influence

Named = Mapping[Names, Scored]


def find(
    recordings: Recordings, found: Search, progress: Progress = lambda *_: None
) -> Attempt | None:
    """The law that what is known, the final hypothesis, cannot stand for, if any."""
    if found.weight.leaves_noise(found.chosen, found.threshold):
        return None  # nothing is ahead of it by more than noise gives
    final = scored(Estimate(found.posed, found.final))
    named = {s.names: s for s in found.sets} | {final.names: final}
    laws: dict[Names, Attempt] = {}
    best = None
    for base in _bases(recordings, found):
        progress('what no known effect explains', 1, FIT)
        laws |= {a.scored.names: a for a in _tried(recordings, found, *base)}
        progress('what no known effect explains', 1, FIT)
        if found.problem.late():
            return None
        best = _best(found, named, laws) if laws else None
        if best and best.effect and not found.problem.numerics.sparing:
            _near(found, named, laws, best)
            best = _best(found, named, laws)
        if best and not rest_of(found.problem, found.null, best.fit).matters:
            break
    gates = found.weight.gates
    if best is None or best.law.known(gates.law_periods) or best.removed < gates.material:
        return None
    return replace(best, base=named[best.named].fit)


def without(found: Search, law: Attempt) -> Search:
    """The search with the named effects that stay next to a law, fitted without it."""
    return replace(found, final=law.base, chosen=found.known(law.named) or found.chosen)


def _near(
    found: Search, named: dict[Names, Scored], laws: dict[Names, Attempt], law: Attempt
) -> None:
    """Fit a law with the named effects that linear algebra finds best beside it.

    Those that were chosen without it may have stood for a part of it.
    """
    assert found.near
    for at in found.near(law.scored.at).larger:
        names = at.names - {law.candidate}
        if law.candidate in at.names and at.names not in laws:
            if names not in named:
                rest = Hypothesis(tuple(names), at.fit.hypothesis.constants)
                theta = rest.carried(at.fit.hypothesis, at.fit.theta)
                base = fit(found.problem, rest, theta, found.null.start)
                named[names] = scored(at._replace(fit=base))
            laws[at.names] = law.beside(at, named[names].fit)


def _best(found: Search, named: Named, laws: dict[Names, Attempt]) -> Attempt | None:
    """The best law that is supported, once its parts are fitted too."""
    while (best := _leading(found, named, laws)) and (parts := _unfitted(best, named, laws)):
        for names in parts:
            base = named[names - {best.candidate}].fit
            posed = best.scored.at.posed
            laws[names] = joined(posed, base, best.left, best.fitted_law, best.candidate)
    return best


def _leading(found: Search, named: Named, laws: Mapping[Names, Attempt]) -> Attempt | None:
    """The best law that is supported, or may be once its parts are fitted.

    What the catalogue has is preferred: a law must be ahead of every named set by more than noise
    gives, and surely predict better than those of as many effects, too.
    """
    sets, limit = [*named.values(), *(a.scored for a in laws.values())], found.threshold
    weight = weigh(sets, found.weight.most / found.weight.spread)
    for first in weight.ordered([a.scored for a in laws.values()]):
        law, rivals = laws[first.names], named.values()
        as_few = [s for s in rivals if len(s.names) <= len(first.names)]
        if (
            all(weight.ahead(first, s) > limit for s in rivals)
            and all(weight.supports(s, first, limit) for s in as_few)
            and (_unfitted(law, named, laws) or supported(sets, first, weight, limit))
        ):
            return law
    return None


def _unfitted(law: Attempt, named: Named, laws: Mapping[Names, Attempt]) -> list[Names]:
    """Sets not fitted yet: the law with all of its named effects but one."""
    parts = [law.named - {effect} for effect in law.named]
    return [p | {law.candidate} for p in parts if p in named and p | {law.candidate} not in laws]


def _bases(recordings: Recordings, found: Search) -> Iterator[tuple[Fit, Influence, list[Curve]]]:
    """The model as given and what was chosen, with what each leaves and its curves, best first.

    A law may stand for one or two effects; beside more, which were chosen together, it is looked
    for in what these leave, if that matters. Where a law is expensive (`sparing`), the chosen set
    is tried only if what it leaves matters, and the model as given only if a curve shows in what
    the chosen set leaves, or if two of its effects share a place.
    """
    problem, final, sparing = found.problem, found.final, found.problem.numerics.sparing
    many = len(final.hypothesis.candidates) > problem.numerics.law_stands_for
    if many:
        if rest_of(problem, found.null, final).matters:
            yield final, *_curves(recordings, problem, final)
        return
    after = _curves(recordings, problem, final) if sparing else None
    places = [c.where for c in final.hypothesis.candidates]
    crowded = len(set(places)) < len(places)
    if places and (after is None or crowded or _shows(after[1][0], found)):
        yield found.null, *_curves(recordings, problem, found.null)
    if after is None or rest_of(problem, found.null, final).matters:
        yield final, *(after or _curves(recordings, problem, final))


def _curves(recordings: Recordings, problem: Problem, base: Fit) -> tuple[Influence, list[Curve]]:
    left = influence(problem, base)
    return left, curves(left, paths(recordings, left))


def _shows(curve: Curve, found: Search) -> bool:
    """Whether a curve predicts more than noise gives."""
    return curve.gain > found.threshold * found.weight.spread


def _tried(
    recordings: Recordings, found: Search, base: Fit, left: Influence, best: Sequence[Curve]
) -> list[Attempt]:
    """The laws of the best curves, one of each variable and carrier, fitted with the base."""
    first: dict[tuple, Curve] = {}
    for c in best:
        first.setdefault((c.joint, c.variable.name, c.carrier, bool(c.hertz)), c)
    leading = islice(first.values(), found.problem.numerics.laws_tried)
    worth = [c for c in leading if _shows(c, found)]
    try_one = partial(attempt, recordings, found.posed, base, left, found.weight)
    return [a.on(base) for a in trials.spread(try_one, worth)]
