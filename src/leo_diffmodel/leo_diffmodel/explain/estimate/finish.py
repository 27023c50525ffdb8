# SPDX-License-Identifier: Apache-2.0
"""A fit brought to the least loss there is, and completed with what held-out recordings own.

Laws with corners (dry friction, dead zones, limits) leave several valleys in the loss: the fit is
made again from other values until two starts agree, and along each parameter, the others
following, the loss is looked up on both sides.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import takewhile

import numpy as np
from scipy.linalg import block_diag

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.estimator import as_fitted, FIT, Progress, Widened
from leo_diffmodel.explain.estimate.fit import fit, read_at
from leo_diffmodel.explain.estimate.fitted import Certificate, dispersion, Fit
from leo_diffmodel.explain.estimate.settle import settle
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_sim.description.robot import Constant


def finished(
    problem: Problem,
    fitted: Fit,
    starts: Sequence[Array],
    progress: Progress = lambda *_: None,
    widened: Widened = as_fitted,
) -> Fit:
    """The fit at the least loss that several starts lead to, with its certificate.

    It begins where the search left it, then at other `starts`, each (P,), until two ends agree.
    The last two begin to each side of the best, a standard error in each direction of the
    covariance; of many parameters those are all. Ends are one where nobody can tell them apart by
    the errors that an answer says (`widened`).
    """
    hypothesis = fitted.hypothesis
    best = _profiled(problem, fit(problem, hypothesis, fitted.theta, fitted.start, thorough=True))
    ends = [best]
    many = len(best.theta) > problem.numerics.profiled
    for theta in (None, None) if many else (*starts, None, None):
        if _reached(problem, ends, widened(best)) > 1 or problem.late():
            break
        progress('the last fit', 1, FIT)
        if theta is None:
            theta = hypothesis.bounded(best.theta + (-1) ** len(ends) * _error_off(best))
        other = fit(problem, hypothesis, theta, thorough=True)
        if other.lost(problem.train) < best.lost(problem.train) - _tolerance(problem, best):
            other = _profiled(problem, other)
        ends.append(other)
        best = min(ends, key=lambda end: end.lost(problem.train))
    best = widened(best)
    reached = _reached(problem, ends, best)
    converged = reached > 1 and best.ended
    return replace(best, certificate=Certificate(best.decrement, len(ends), reached, converged))


def _error_off(fitted: Fit) -> Array:
    """Parameters (P,) off by a standard error in each direction of their covariance."""
    variance, directions = np.linalg.eigh(fitted.covariance)
    root = directions * np.sqrt(np.maximum(variance, 0.0)) @ directions.T
    return np.asarray(root.sum(axis=1))


def _reached(problem: Problem, ends: Sequence[Fit], best: Fit) -> int:
    """How many fits ended at the least loss, or at its values."""
    least = best.lost(problem.train) + _tolerance(problem, best)
    near = problem.numerics.same_values
    return sum(end.lost(problem.train) <= least or _apart(best, end) <= near for end in ends)


def _apart(best: Fit, end: Fit) -> float:
    """How far two ends of a fit are apart: standard errors, rms over directions (Mahalanobis)."""
    off, errors = end.theta - best.theta, best.standard_errors
    seen = errors > 0
    if off[~seen].any():
        return np.inf
    shown = off[seen] / errors[seen]
    alike = best.covariance[np.ix_(seen, seen)] / np.outer(errors[seen], errors[seen])
    return float(np.sqrt(shown @ np.linalg.pinv(alike) @ shown / max(len(shown), 1)))


def _tolerance(problem: Problem, fitted: Fit) -> float:
    return problem.numerics.same_nats * dispersion(fitted)


def _profiled(problem: Problem, fitted: Fit) -> Fit:
    """The fit from the best value of a profile on, as long as one is better than its end."""
    if len(fitted.theta) > problem.numerics.profiled:
        return fitted
    for _ in range(problem.numerics.profiles):
        if problem.late():
            break
        least, begin = fitted.lost(problem.train) - _tolerance(problem, fitted), None
        weighed = replace(problem, typical=fitted.typical)
        values = _profile(fitted, problem.numerics.profile)
        for theta in takewhile(lambda _: not problem.late(), values):
            settled = settle(weighed, fitted.hypothesis, theta, (fitted.start,))
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


def completed(problem: Problem, fitted: Fit, own: Sequence[Constant]) -> Fit:
    """A fit with the `own` constants of held-out recordings, each known from a part of its own.

    A payload cannot be known from other recordings: it is found in the recording itself, all that
    was learned from the others held fast (the fit says where to begin), and judged by the rest.
    """
    if problem.telling is None:
        return fitted
    able = replace(problem, train=problem.telling).trained
    own = tuple(c for c in own if c.recording in able)
    if not own:
        return fitted
    rest, theta = _without(fitted, own)
    found, starts = _found(problem, rest, Hypothesis(constants=own), theta)
    columns = np.zeros((*rest.residual.shape, len(own)))
    columns[~problem.train] = found.columns
    constants = (*rest.hypothesis.constants, *own)
    whole = replace(
        rest,
        hypothesis=replace(rest.hypothesis, constants=constants),
        start=starts,
        theta=np.concatenate([rest.theta, found.theta]),
        covariance=block_diag(rest.covariance, found.covariance),
        beyond=np.vstack([rest.beyond, found.beyond]),
        columns=np.concatenate([rest.columns, columns], axis=-1),
    )
    return read_at(problem, whole)


def _found(problem: Problem, rest: Fit, own: Hypothesis, theta: Array | None) -> tuple[Fit, Array]:
    assert problem.telling is not None
    outside = np.flatnonzero(~problem.train)
    part = problem.fixed(rest.hypothesis, rest.theta).take(outside)
    found = fit(replace(part, train=problem.telling[outside]), own, theta, rest.start[outside])
    starts, everywhere = rest.start.copy(), np.ones(len(outside), dtype=bool)
    begun = found.start, part.windows.measured[:, 0]
    starts[outside] = settle(replace(part, train=everywhere), own, found.theta, begun).start
    return found, starts


def _without(fitted: Fit, own: Sequence[Constant]) -> tuple[Fit, Array | None]:
    """A fit without these constants, and their values in it; None where it has none of them."""
    hypothesis = fitted.hypothesis
    rest = tuple(c for c in hypothesis.constants if c not in own)
    count = len(hypothesis.constants) - len(rest)
    if not count:
        return fitted, None
    kept = slice(None, hypothesis.size - count)
    alone = replace(
        fitted,
        theta=fitted.theta[kept],
        covariance=fitted.covariance[kept, kept],
        beyond=fitted.beyond[kept],
        columns=fitted.columns[..., kept],
        hypothesis=replace(hypothesis, constants=rest),
    )
    return alone, fitted.theta[-count:]
