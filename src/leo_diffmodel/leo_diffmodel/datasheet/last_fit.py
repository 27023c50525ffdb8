# SPDX-License-Identifier: Apache-2.0
"""The last fit of a data sheet: its values as they would be without an integration step.

A log of a minute tells a constant to a few parts in ten thousand. The scheme is of first order:
what a step of 1.25 ms is off by moved a rotor inertia by eight standard errors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.datasheet.settings import FINER, MOST_FINER, STEP_ERROR
from leo_diffmodel.explain.estimate.covariance import covariance
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import dispersion, Fit
from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray


def last_fit(problem: Problem, fitted: Fit) -> Fit:
    """A fit made again with finer and finer steps, and what the last one leaves taken off.

    Halving a step twice leaves a quarter of what it was off by: a third of what that moves a value
    (Richardson 1911). It goes into the value, and as much into its error.
    """
    for power in range(1, MOST_FINER + 1):
        before, fitted = fitted, _stepped(problem, fitted, FINER**power)
        left = (fitted.theta - before.theta) * FINER / (1.0 - FINER)
        if (np.abs(left) <= STEP_ERROR * fitted.standard_errors).all():
            break
    theta = fitted.hypothesis.bounded(fitted.theta + left)
    return replace(fitted, theta=theta, covariance=_wider(problem, fitted) + np.outer(left, left))


def _wider(problem: Problem, fitted: Fit) -> Array:
    """Covariance with the larger of the variances that blocks and residual give, (P, P)."""
    train, channels = problem.train, fitted.start.shape[-1]
    residual = fitted.residual[train]
    block = np.arange(len(residual)) if problem.block is None else problem.block[train]
    prior, spread = fitted.hypothesis.prior(fitted.theta), dispersion(fitted.take(train))
    weighed = prior, spread, channels, problem.numerics, fitted.typical
    return covariance(fitted.columns[train], residual, block, *weighed, larger=True)


def _stepped(problem: Problem, fitted: Fit, share: float) -> Fit:
    base = problem.base.changed(integration_step=share * problem.base.integration_step)
    finer = replace(problem, base=base, rough_step=None)
    return fit(finer, fitted.hypothesis, fitted.theta, fitted.start, thorough=True)
