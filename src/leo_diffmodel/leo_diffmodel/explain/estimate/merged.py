# SPDX-License-Identifier: Apache-2.0
"""One cause in the place of several effects: a payload for a heavier link, its centre moved."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import dispersion, Fit
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray


def merged(problem: Problem, fitted: Fit, pool: Iterable[Candidate]) -> Fit:
    """A fit with one cause of the pool for effects at one link, where that does better.

    Linear algebra finds the effects, as what the cause does is no straight line in its place. On
    a single hinge both do the same, and the effects stay.
    """
    for law in [c for c in pool if c.effect.together]:
        here = [c for c in fitted.hypothesis.candidates if c.where == law.where]
        parts = [c for c in here if c.effect.name in law.effect.together]
        if len(parts) < len(law.effect.together) or problem.late():
            continue
        hypothesis, theta = _begin(problem, fitted, parts, law)
        if (theta < hypothesis.low).any() or (theta > hypothesis.high).any():
            continue
        other = fit(problem, hypothesis, theta, fitted.start, thorough=True)
        alike = problem.gates.equal_nats * max(dispersion(fitted), 1.0)
        if other.lost(problem.train) < fitted.lost(problem.train) - alike:
            fitted = other
    return fitted


def _begin(
    problem: Problem, fitted: Fit, parts: Sequence[Candidate], law: Candidate
) -> tuple[Hypothesis, Array]:
    """The hypothesis with the cause, and its values, by the link that the effects make."""
    full = fitted.hypothesis
    rest = Hypothesis(tuple(c for c in full.candidates if c not in parts), full.constants)
    theta = rest.carried(full, fitted.theta)
    points = (rest, theta), (full, fitted.theta)
    links = (h.model(problem.base, t).laws.bodies[law.where] for h, t in points)
    values = law.effect.between(*links)
    own = [float(values[p.name]) for p in law.parameters]
    first = rest.first_constant
    return rest.with_candidate(law), np.concatenate([theta[:first], own, theta[first:]])
