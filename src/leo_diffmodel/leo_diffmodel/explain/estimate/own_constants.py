# SPDX-License-Identifier: Apache-2.0
"""What held-out recordings tell of themselves: the constants that each has of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from leo_diffmodel.explain.estimate.fit import fit, read_at
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.settle import settle
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_sim.description.robot import Constant

Array = np.ndarray


def completed(problem: Problem, fitted: Fit, own: Sequence[Constant]) -> Fit:
    """A fit with the own constants of held-out recordings, which each tells by a part of itself.

    A payload cannot be known from other recordings. So it is treated as the start state of a
    window is: found in the recording, all that was learned from the others held fast, and judged
    by the blocks that did not tell it.

    Args:
        problem: with the windows that tell.
        fitted: a hypothesis; what it says of these constants is where the search for them begins.
        own: the constants; without any the fit stays as it is.
    """
    if problem.telling is None:
        return fitted
    able = replace(problem, train=problem.telling).trained
    own = tuple(c for c in own if c.recording in able)
    if not own:
        return fitted
    rest, theta = _apart(fitted, own)
    found, starts = _found(problem, rest, Hypothesis(constants=own), theta)
    columns = np.zeros((*rest.residual.shape, len(own)))
    columns[~problem.train] = found.columns
    constants = (*rest.hypothesis.constants, *own)
    return read_at(
        problem,
        replace(
            rest,
            hypothesis=replace(rest.hypothesis, constants=constants),
            start=starts,
            theta=np.concatenate([rest.theta, found.theta]),
            covariance=block_diag(rest.covariance, found.covariance),
            columns=np.concatenate([rest.columns, columns], axis=-1),
        ),
    )


def _found(problem: Problem, rest: Fit, own: Hypothesis, theta: Array | None) -> tuple[Fit, Array]:
    """The constants in the windows that tell them, and the start states of all windows (W, 2J)."""
    assert problem.telling is not None
    outside = np.flatnonzero(~problem.train)
    part = problem.fixed(rest.hypothesis, rest.theta).take(outside)
    found = fit(replace(part, train=problem.telling[outside]), own, theta, rest.start[outside])
    starts, everywhere = rest.start.copy(), np.ones(len(outside), dtype=bool)
    begun = found.start, part.windows.measured[:, 0]
    starts[outside] = settle(replace(part, train=everywhere), own, found.theta, begun).start
    return found, starts


def _apart(fitted: Fit, own: Sequence[Constant]) -> tuple[Fit, Array | None]:
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
        columns=fitted.columns[..., kept],
        hypothesis=replace(hypothesis, constants=rest),
    )
    return alone, fitted.theta[-count:]
