# SPDX-License-Identifier: Apache-2.0
"""Steps of a fit on the ground, each with windows settled on contacts of their own."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from leo_diffmodel.explain.estimate.fit import looked_at, moved, Step
from leo_diffmodel.explain.estimate.fitted import dispersion, Fit, gain
from leo_diffmodel.explain.estimate.ground_settle import refined, settled
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.problem.problem import Problem


class Iterate(NamedTuple):
    """A hypothesis at some values, linearised there, and the next step of its fit."""

    posed: Posed
    fit: Fit
    step: Step


def settled_on_ground(problem: Problem) -> Problem:
    """The problem with its windows settled, those that can be trusted; itself without contacts."""
    if not problem.base.robot.contacts:
        return problem
    kept, linearisation = settled(problem)
    return replace(problem.take(kept), linearisation=linearisation)


def linearised(
    posed: Posed, point: Fit, finer: bool = False, relinearise: bool = False
) -> Iterate:
    """The hypothesis of `point` at its values, the windows of a settled problem linearised anew.

    `finer`: ask a finer integration what the coarse one is off by now. `relinearise`: find the
    sensitivity of all windows to their start states again.
    """
    problem, hypothesis = posed.problem, point.hypothesis
    assert problem.linearisation
    fixed, before = problem.fixed(hypothesis, point.theta), problem.linearisation
    before = replace(before, start=point.start)
    if finer:
        fixed, before = refined(fixed, before)
    _, linearisation = settled(fixed, before, relinearise)
    problem = replace(problem, windows=fixed.windows, linearisation=linearisation)
    return Iterate(replace(posed, problem=problem), *looked_at(problem, hypothesis, point.theta))


def most_nats(problem: Problem, spread: float) -> float:
    return problem.gates.window_nats * spread


def advanced(at: Iterate, finer: bool = False) -> tuple[Iterate, float]:
    """A step further, or a shorter one, where that is better, and what it gains [nats]."""
    problem = at.posed.problem
    for scale in problem.numerics.strides:
        trial = linearised(at.posed, moved(at.fit, at.step, scale), finer)
        most = most_nats(problem, dispersion(trial.fit))
        if (gained := gain(at.fit, trial.fit, problem.train, most)) > 0:
            return trial, gained
    return at, 0.0


def converged(posed: Posed, best: Fit) -> Iterate:
    """A hypothesis fitted with its windows settled and linearised again at every step."""
    first = at = linearised(posed, best, finer=True)
    gained, numerics = 0.0, posed.problem.numerics
    for _ in range(numerics.ground_iterations if best.hypothesis.size else 0):
        if posed.problem.late():
            break
        at, gained = advanced(at, finer=True)
        if gained < numerics.ground_gain_nats:
            break
    at = at if at is first else linearised(at.posed, at.fit, finer=True)
    return at._replace(fit=replace(at.fit, ended=gained < numerics.ground_gain_nats))


def polished(posed: Posed, best: Fit) -> tuple[Posed, Fit]:
    """A converged hypothesis with all windows linearised again about their start states.

    Before, only windows where it was off by much were: their starts remember the way on which the
    parameters came, which holds these back by about a standard deviation. Single steps gain less
    than the few windows whose contacts settle otherwise; all together must not make it worse.
    """
    problem, numerics = posed.problem, posed.problem.numerics
    at = linearised(posed, best, finer=True, relinearise=True)
    for _ in range(numerics.last_steps):
        if problem.late():
            break
        farthest = standard_errors_moved(at)
        if farthest < numerics.last_errors:
            break
        fitted = moved(at.fit, at.step, min(1.0, numerics.farthest_errors / farthest))
        at = linearised(at.posed, fitted, finer=True, relinearise=True)
    spread = dispersion(best)
    worse = -gain(best, at.fit, problem.train, most_nats(problem, spread)) / spread
    return (at.posed, at.fit) if worse < problem.gates.margin_nats else (posed, best)


def standard_errors_moved(at: Iterate) -> float:
    """The longest next move of a parameter [standard errors]; one on a bound has none."""
    errors = at.fit.standard_errors
    free = errors > 0
    return float((np.abs(at.step.theta)[free] / errors[free]).max(initial=0.0))
