# SPDX-License-Identifier: Apache-2.0
"""A law that no effect at one joint can hold: what the linear answer says of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.explain.estimate.covariance import covariance
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray


def linear_fit(
    problem: Problem, base: Fit, hypothesis: Hypothesis, theta: Array, trace: Array
) -> Fit:
    """A fit with a law beside what it holds, nothing simulated.

    The law's size alone is free, in place of its first parameter.

    Args:
        problem: the windows.
        base: the fit.
        hypothesis: what it holds, and the law as its last effect.
        theta: the values of both, shape (P,).
        trace: what the law does to the prediction, start states projected out, shape (W, N).
    """
    first = hypothesis.offset(len(hypothesis.candidates) - 1)
    columns = np.insert(base.columns, [first] * (len(theta) - len(base.theta)), 0.0, axis=-1)
    columns[..., first] = -trace
    residual, channels, train = base.residual - trace, base.start.shape[-1], problem.train
    numerics = problem.numerics
    typical = problem.typical_of(residual)
    block = np.arange(len(train)) if problem.block is None else problem.block
    spread = shooting.dispersion(residual[train], channels)
    errors = covariance(columns[train], residual[train], block[train], hypothesis.free(theta),
                        spread, channels, numerics, typical)  # fmt: skip
    return replace(base, hypothesis=hypothesis, theta=theta, covariance=errors, columns=columns,
                   loss=shooting.loss(residual, channels, numerics, typical), residual=residual,
                   typical=typical)  # fmt: skip
