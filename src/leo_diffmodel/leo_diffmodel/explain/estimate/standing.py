# SPDX-License-Identifier: Apache-2.0
"""A problem on the ground, its windows settled."""

from __future__ import annotations

from dataclasses import replace

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem.linearisation import refined, settled
from leo_diffmodel.explain.problem.pose import Posed


def standing(posed: Posed) -> Posed:
    """With the windows of a robot on the ground settled, those that can be trusted."""
    problem = posed.problem
    if not problem.base.robot.contacts:
        return posed
    kept, linearisation = settled(problem.base, problem.windows, problem.sigma, problem.settings)
    return replace(posed, problem=replace(problem.take(kept), linearisation=linearisation))


def resettled(posed: Posed, fitted: Fit, finer: bool = False, anew: bool = False) -> Posed:
    """This problem on the ground with the linearisation of a fitted hypothesis.

    Args:
        posed: the problem.
        fitted: the hypothesis at its values and start states.
        finer: ask a finer integration anew what the coarse one is off by.
        anew: find the sensitivity of all windows to their start states again.
    """
    problem = posed.problem
    model = fitted.hypothesis.model(problem.base, fitted.theta)
    assert problem.linearisation
    windows, before = problem.windows, replace(problem.linearisation, start=fitted.start)
    if finer:
        windows, before = refined(model, windows, before)
    _, linearisation = settled(model, windows, problem.sigma, problem.settings, before, anew)
    return replace(posed, problem=replace(problem, windows=windows, linearisation=linearisation))
