# SPDX-License-Identifier: Apache-2.0
"""A law as one effect more beside those that are named."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.compare.sizes import in_volts
from leo_diffmodel.explain.estimate.covariance import covariance
from leo_diffmodel.explain.estimate.estimator import Estimate, far_ends, far_floor
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.select.evidence import score, Scored
from leo_diffmodel.explain.unknown.curves import carry
from leo_diffmodel.explain.unknown.found_effect import expressible, FoundEffect
from leo_diffmodel.explain.unknown.influence import Influence
from leo_diffmodel.explain.unknown.law import Law
from leo_diffmodel.explain.unknown.variables import variables
from leo_sim.effects.base import with_roles

Array = np.ndarray


@dataclass(frozen=True)
class Attempt:
    """A law beside named effects, as the last effect of a hypothesis.

    Attributes:
        law: the law as it was read.
        left: what it was read from.
        scored: the hypothesis with it.
    """

    law: Law
    left: Influence
    scored: Scored

    @property
    def fit(self) -> Fit:
        """The hypothesis, fitted."""
        return self.scored.fit

    @property
    def candidate(self) -> Candidate:
        """The law as an effect."""
        return self.fit.hypothesis.candidates[-1]

    @property
    def named(self) -> frozenset[Candidate]:
        """The named effects."""
        return self.scored.names - {self.candidate}

    @property
    def effect(self) -> FoundEffect | None:
        """The law with the values of the fit; None where no effect at one joint can hold it.

        Such a law is judged as if all were linear.
        """
        made, law = self.candidate.effect, self.fitted_law
        assert isinstance(made, FoundEffect)
        able = expressible(law, made.joint)
        return FoundEffect(law, made.joint, made.per_torque) if able else None

    @property
    def fitted_law(self) -> Law:
        """The law with the values of the fit."""
        first = self.fit.hypothesis.offset(len(self.fit.hypothesis.candidates) - 1)
        return self.law.settled(self.fit.theta[first : first + len(self.law.values)])

    def refitted(self, fitted: Fit) -> Attempt:
        """This attempt with another fit of its hypothesis."""
        at = self.scored.at._replace(fit=fitted)
        return replace(self, scored=replace(self.scored, at=at))

    def on(self, base: Fit) -> Attempt:
        """This attempt with the very effects of a fit, of which another process gives copies."""
        hypothesis = base.hypothesis.with_candidate(self.candidate)
        return self.refitted(replace(self.fit, hypothesis=hypothesis))


def beside(
    posed: Posed, base: Fit, left: Influence, law: Law, candidate: Candidate | None = None
) -> Attempt:
    """A law beside what a fit holds.

    Args:
        posed: the problem.
        base: the fit.
        left: what the law was read from.
        law: the law, with the values to begin with.
        candidate: the law as an effect, where there is one already.
    """
    joint = left.model.robot.joint_names[law.curve.joint]
    hypothesis = base.hypothesis.with_candidate(candidate or _effect(left, law, joint))
    first = hypothesis.offset(len(hypothesis.candidates) - 1)
    theta = np.concatenate([base.theta[:first], law.values, base.theta[first:]])
    if not expressible(law, joint):
        trace = trace_of(left, law) / left.root
        linear = linear_fit(posed.problem, base, hypothesis, theta, trace)
        return Attempt(law, left, score(Estimate(posed, linear)))
    made = scored(Estimate(posed, fit(posed.problem, hypothesis, theta, base.start)))
    return Attempt(law, left, _owing(made, law) if law.read else made)


def scored(at: Estimate) -> Scored:
    """A hypothesis with what it predicts of the folds left out, and far ahead."""
    return replace(score(at), ends=far_ends(at, far_floor(at.posed)))


def _owing(made: Scored, law: Law) -> Scored:
    """Less what the values of a curve owe to each fold, from which they were read as well."""
    score, (_, number) = law.curve.score, np.unique(made.fold, return_inverse=True)
    owed = (score.fitted - score.left_out) / np.bincount(number)
    return replace(made, left=made.left + owed[number])


def _effect(left: Influence, law: Law, joint: str) -> Candidate:
    per_torque = in_volts(left.problem.base.robot, joint, 1.0) or 1.0
    effect = FoundEffect(law, joint, per_torque)
    return Candidate(effect, joint, with_roles(effect, law.parameters))


def trace_of(left: Influence, law: Law) -> Array:
    """Change of the prediction by a law, weighted, shape (W, N)."""
    curve = law.curve
    carried = carry(left, curve.carrier, curve.joint)
    variable = next(v for v in variables(left, curve.joint) if v.kind == curve.variable.kind)
    return left.trace(law.at(variable.values) * carried, curve.joint)


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
    spread = likelihood.dispersion(residual[train], channels)
    errors = covariance(
        columns[train],
        residual[train],
        block[train],
        hypothesis.free(theta),
        spread,
        channels,
        numerics,
        typical,
    )
    return replace(
        base,
        hypothesis=hypothesis,
        theta=theta,
        covariance=errors,
        columns=columns,
        loss=likelihood.loss(residual, channels, numerics, typical),
        residual=residual,
        typical=typical,
    )
