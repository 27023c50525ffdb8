# SPDX-License-Identifier: Apache-2.0
"""Fit what an explanation of a robot on the ground left open, in some windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.ground_scan import GroundScanner
from leo_diffmodel.explain.estimate.standing import converged, standing
from leo_diffmodel.explain.problem.candidates import uncertain
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.problem.sizes import scales_of

MOST_WINDOWS = 80


def linearised(posed: Posed) -> tuple[Posed, float]:
    """Some of the windows, settled and all open to the fit, and which share of all they are."""
    count = posed.problem.windows.count
    some = np.linspace(0, count - 1, min(MOST_WINDOWS, count)).astype(int)
    posed = standing(posed.take(some))
    problem = replace(posed.problem, train=np.ones_like(posed.problem.train))
    return replace(posed, problem=problem), problem.windows.count / count


def fit_in_turn(posed: Posed, share: float, candidates: Sequence[Candidate]) -> Fit:
    """Add effects one by one, each from where a scan points; sure as all windows would make it.

    Args:
        posed: the windows with their linearisation.
        share: of all windows that these are.
        candidates: in their order.
    """
    problem = posed.problem
    found = fit(problem, Hypothesis(constants=uncertain(problem.base, problem.trained)))
    scales = scales_of(problem.base, problem.windows)
    for candidate in candidates:
        scan = GroundScanner(posed.problem, found, scales).scan(candidate)
        hypothesis = found.hypothesis.with_candidate(candidate)
        at = replace(found, hypothesis=hypothesis, theta=hypothesis.bounded(scan.theta))
        posed, found, _ = converged(posed, at)
    return replace(found, covariance=share * found.covariance)
