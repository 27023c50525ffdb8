# SPDX-License-Identifier: Apache-2.0
"""What small differences without a name leave to doubt of the named effects.

Beside the named effects every other candidate may be there at a small size: y = A theta + B phi
+ noise, phi normal about 0 with one scale for all, in units of what changes each sample by its
noise. The scale is the most likely one (empirical Bayes; George and McCulloch 1993, Kennedy and
O'Hagan 2001); 0 where nothing small is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.matrices import indices, Matrices, square
from leo_diffmodel.explain.estimate.terms import Term
from leo_diffmodel.explain.problem.hypothesis import Candidate


@dataclass(frozen=True)
class Background:
    scale: float  # their typical size [noise of each sample]
    # by how much standard errors of each effect's parameters are larger, (P,) each
    factors: dict[Candidate, Array]

    def widened(self, fitted: Fit) -> Fit:
        full = fitted.hypothesis
        times = [self.factors.get(c, np.ones(len(c.parameters))) for c in full.candidates]
        each = np.concatenate([*times, np.ones(len(full.constants))])
        return replace(fitted, covariance=fitted.covariance * np.outer(each, each))


def background(made: Matrices, named: Sequence[Candidate], spread: float) -> Background:
    """The most likely background of `named` effects; `spread` as of `dispersion`."""
    held = [t for t in made.members if t.candidate in named]
    others: dict[Candidate, Term] = {}
    for term in made.terms:
        if term.candidate not in named:
            others.setdefault(term.candidate, term)
    inside, outside = indices(held), indices([*others.values()])
    held_by = square(made.gram, inside)
    across = made.gram[np.ix_(inside, outside)]
    free = made.gram[np.ix_(outside, outside)] - across.T @ np.linalg.solve(held_by, across)
    left = made.along[outside] - across.T @ np.linalg.solve(held_by, made.along[inside])
    variance = made.samples * _likeliest(free, left / np.sqrt(spread), made.samples)
    if not variance > 0 or not inside:
        return Background(0.0, {})
    known = made.gram[np.ix_(outside, outside)] + np.eye(len(outside)) * spread / variance
    wider = np.linalg.inv(held_by - across @ np.linalg.solve(known, across.T))
    times = np.sqrt(np.diag(wider) / np.diag(np.linalg.inv(held_by)))
    return Background(float(np.sqrt(variance / made.samples)), _by_effect(held, times))


def _likeliest(free: Array, left: Array, samples: int) -> float:
    """Square of the most likely scale, from products with columns beside those of a set.

    Of these there are as many directions as candidates; along each the product is normal.
    """
    values, vectors = np.linalg.eigh(free)
    seen = values > 1e-6
    if not seen.any():
        return 0.0
    strength = samples * values[seen]
    shown = (vectors.T @ left)[seen] ** 2 / values[seen]

    def surprise(log_scale: float) -> float:
        times = 1.0 + np.exp(2 * log_scale) * strength
        return 0.5 * float(np.sum(np.log(times) + shown / times))

    nothing, most = -14.0, 2.0  # logarithms: none, and more than what is named
    best = minimize_scalar(surprise, bounds=(nothing, most), method='bounded')
    return float(np.exp(2 * best.x)) if best.fun < surprise(nothing) else 0.0


def _by_effect(held: Sequence[Term], times: Array) -> dict[Candidate, Array]:
    """Factors of columns, term by term, as those of each effect's parameters."""
    columns, found = iter(times), {}
    for term in held:
        factors = np.ones(len(term.begin))
        for column in term.columns:
            factors[column.direction != 0] = next(columns)
        found[term.candidate] = factors
    return found
