# SPDX-License-Identifier: Apache-2.0
"""The search: from where it begins to the best set near each best set, until none is better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem.hypothesis import Candidate, EVERYWHERE
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.judged import judged, usual
from leo_diffmodel.explain.select.sets import chosen, Sets


def searched(
    sets: Sets, first: Estimate, recordings: Sequence[Recording], near: Fit | None = None
) -> Scored:
    """The set that is chosen once all near it are known; the best so far if the time is over.

    Where few effects are enough, others as few may do as well: they are looked for about the
    model as given, too.

    Args:
        sets: takes what is fitted.
        first: the model as given.
        recordings: all of them.
        near: what was chosen with a longer integration step, where the search begins.
    """
    sets.add([first])
    begun = sets.estimator.begun(first, recordings, sets.pool, sets.progress, near)
    sets.usual = usual(sets, begun)
    best = judged(sets, begun)
    if len(best.names) <= sets.settings.gates.many:
        sets.extend(frozenset())
        best = _best(sets)
    while best.names not in sets.extensions:
        sets.extend(best.names)
        best = _best(sets)
        if sets.late:
            break
    return sets.ordered()[0] if sets.late else _shared(sets, best)


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
    own = [fitted.own(c) for c in full.candidates if c not in rest]
    constants = fitted.theta[full.first_constant :]
    theta = np.concatenate([*map(fitted.own, rest), np.mean(own, axis=0), constants])
    part = replace(full, candidates=(*rest, candidate))
    return sets.estimator.refitted(best.at, part, theta)


def _best(sets: Sets) -> Scored:
    """The set that is chosen, once the best ones are judged."""
    width = sets.settings.numerics.width
    while not sets.late and (
        new := [s for s in sets.ordered()[:width] if id(s.fit) not in sets.judged]
    ):
        sets.judged[id(new[0].fit)] = new[0].fit
        judged(sets, new[0].at)
    return chosen([*sets.known.values()], sets.weight, sets.threshold)


def _agree(fitted: Fit, shared: Candidate, joints: int, most: float) -> bool:
    """Whether half the joints have an effect, and of one value as far as their errors say."""
    full = fitted.hypothesis
    held = full.candidates
    own = [n for n, c in enumerate(held) if c.effect.name == shared.effect.name]
    if not 2 * len(own) >= joints > 0 or any(held[n].where == EVERYWHERE for n in own):
        return False
    spans = [slice(full.offset(n), full.offset(n + 1)) for n in own]
    values = np.array([fitted.theta[s] for s in spans])
    errors = np.array([fitted.standard_errors[s] for s in spans]) + 1e-12
    apart = np.abs(values - np.average(values, axis=0, weights=errors**-2)) / errors
    return bool(apart.max() < most)
