# SPDX-License-Identifier: Apache-2.0
"""Bring a fit to the least loss there is, and say how surely it is there.

The fit is made again from other values until two starts end at the same least loss. Laws with
corners (dry friction, dead zones, limits) leave kinks and several valleys in the loss, in which a
fit may rest: along each parameter, the others following, the loss is looked up on both sides.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import takewhile

import numpy as np

from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Certificate, Fit
from leo_diffmodel.explain.estimate.loss import dispersion
from leo_diffmodel.explain.estimate.settle import settle
from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray


def finished(problem: Problem, fitted: Fit, starts: Sequence[Array]) -> Fit:
    """The fit at the least loss that several starts lead to, with its certificate.

    Args:
        problem: the windows.
        fitted: the hypothesis where the search left it.
        starts: other values to begin with, each (P,); as many are tried as it takes for two ends
            to agree. The last two begin a standard error to each side of the best.
    """
    hypothesis = fitted.hypothesis
    best = _profiled(problem, fit(problem, hypothesis, fitted.theta, fitted.start, thorough=True))
    ends = [best]
    for theta in (*starts, None, None):
        if _reached(problem, ends, best) > 1 or problem.late():
            break
        begin = _aside(best, len(ends)) if theta is None else theta
        other = fit(problem, hypothesis, begin, thorough=True)
        if _loss(problem, other) < _loss(problem, best) - _tolerance(problem, best):
            other = _profiled(problem, other)
        ends.append(other)
        best = min(ends, key=partial(_loss, problem))
    reached = _reached(problem, ends, best)
    converged = reached > 1 and best.ended
    return replace(best, certificate=Certificate(best.decrement, len(ends), reached, converged))


def _reached(problem: Problem, ends: Sequence[Fit], best: Fit) -> int:
    """How many fits ended at the least loss, or at its values."""
    least = _loss(problem, best) + _tolerance(problem, best)
    near = problem.numerics.same_values * best.standard_errors
    return sum(
        _loss(problem, end) <= least or bool((np.abs(end.theta - best.theta) <= near).all())
        for end in ends
    )


def _tolerance(problem: Problem, fitted: Fit) -> float:
    return problem.numerics.same_nats * dispersion(fitted)


def _aside(fitted: Fit, number: int) -> Array:
    """Values a standard error from those of a fit, to one side or the other."""
    return fitted.hypothesis.bounded(fitted.theta + (-1) ** number * fitted.standard_errors)


def _profiled(problem: Problem, fitted: Fit) -> Fit:
    """The fit from the best value of a profile on, as long as one is better than its end."""
    for _ in range(problem.numerics.profiles):
        if problem.late():
            break
        least, begin = _loss(problem, fitted) - _tolerance(problem, fitted), None
        told = replace(problem, typical=fitted.typical)
        values = _profile(fitted, problem.numerics.profile)
        for theta in takewhile(lambda _: not problem.late(), values):
            settled = settle(told, fitted.hypothesis, theta, (fitted.start,))
            loss = float(settled.loss[problem.train].sum())
            if loss < least:
                least, begin = loss, (theta, settled.start)
        if begin is None:
            break
        fitted = fit(problem, fitted.hypothesis, *begin, thorough=True)
    return fitted


def _profile(fitted: Fit, errors_off: Sequence[float]) -> Iterator[Array]:
    """Values along each parameter with a standard error, the others where they are best then."""
    errors = fitted.standard_errors
    for i in np.flatnonzero(errors > 0):
        for by in errors_off:
            theta = fitted.theta + by / errors[i] * fitted.covariance[:, i]
            yield fitted.hypothesis.bounded(theta)


def _loss(problem: Problem, fitted: Fit) -> float:
    return float(fitted.loss[problem.train].sum())
