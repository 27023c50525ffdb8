# SPDX-License-Identifier: Apache-2.0
"""One cause in the place of several effects: a payload for a heavier link, its centre moved."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.select.sets import Sets

Array = np.ndarray


def merged(sets: Sets, at: Estimate) -> Estimate:
    """A set with one cause for effects at one link, where that predicts better.

    Linear algebra finds the effects, as the cause is no straight line in its place.
    """
    for law in sets.pool:
        parts = [
            c for c in at.names if c.where == law.where and c.effect.name in law.effect.together
        ]
        if not law.effect.together or len(parts) < len(law.effect.together) or sets.late:
            continue
        names = at.names.difference(parts) | {law}
        if names not in sets.known and (begin := _begin(at, parts, law)):
            sets.add([sets.estimator.refitted(at, *begin)])
        other = sets.known.get(names)
        if other and sets.weight.ahead(other, sets.keep(at)) > 0:
            at = other.at
    return at


def _begin(
    at: Estimate, parts: list[Candidate], law: Candidate
) -> tuple[Hypothesis, Array] | None:
    """The hypothesis and its values, by the link that effects make; None where out of bounds."""
    full, base = at.fit.hypothesis, at.problem.base
    rest = Hypothesis(tuple(c for c in full.candidates if c not in parts), full.constants)
    theta = rest.carried(full, at.fit.theta)
    bodies = (
        hypothesis.model(base, values).laws.bodies[law.where]
        for hypothesis, values in ((rest, theta), (full, at.fit.theta))
    )
    values = law.effect.between(*bodies)
    own = np.array([float(values[p.name]) for p in law.parameters])
    if not all(p.low <= v <= p.high for p, v in zip(law.parameters, own, strict=True)):
        return None
    made = rest.with_candidate(law)
    first = rest.first_constant
    return made, np.concatenate([theta[:first], own, theta[first:]])
