# SPDX-License-Identifier: Apache-2.0
"""What each recording asks for the size of an effect to be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.findings.findings import Own
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices
from leo_diffmodel.explain.problem.problem import Problem


def own_values(
    problem: Problem, final: Fit, bags: Sequence[str], fewest: int
) -> tuple[dict[int, list[Own]], ...]:
    """For each effect, by its parameters that scale it, the values that recordings ask for.

    Args:
        problem: the windows.
        final: the joint fit.
        bags: names of the recordings, in the order of the windows' `source`.
        fewest: blocks of a recording that tells its own value.
    """
    candidates, hypothesis = final.hypothesis.candidates, final.hypothesis
    firsts = [hypothesis.offset(i) for i in range(len(candidates))]
    scaling = [
        [f + i for i in amplitude_indices(c.parameters)]
        for f, c in zip(firsts, candidates, strict=True)
    ]
    return tuple({i: _of(problem, final, bags, fewest, i) for i in places} for places in scaling)


def _of(problem: Problem, final: Fit, bags: Sequence[str], fewest: int, index: int) -> list[Own]:
    """The values of parameter `index`, all else as it is.

    One Newton step from the joint fit; the interval is that of a sandwich over the blocks of the
    recording, with Student's t.
    """
    assert problem.block is not None
    weight = likelihood.robust_weight(
        final.residual, final.start.shape[-1], problem.numerics, final.typical
    )
    column = final.columns[..., index]
    slopes = (weight * column * final.residual).sum(axis=-1)
    curvature = (weight * column**2).sum(axis=-1)
    own = []
    for number, bag in enumerate(bags):
        mine = problem.windows.source == number
        blocks, where = np.unique(problem.block[mine], return_inverse=True)
        whole = float(curvature[mine].sum())
        if len(blocks) < fewest or not whole > 0:
            continue
        value = float(final.theta[index] - slopes[mine].sum() / whole)
        spread = float(np.sqrt((np.bincount(where, slopes[mine]) ** 2).sum())) / whole
        own.append(Own(bag, value, spread * float(stdtrit(len(blocks) - 1, 0.975))))
    return own
