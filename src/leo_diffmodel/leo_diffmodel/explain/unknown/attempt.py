# SPDX-License-Identifier: Apache-2.0
"""Try a curve in earnest: its law as an effect, fitted together with everything else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.sizes import in_volts
from leo_diffmodel.explain.estimate.contact import converged
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.far_ahead import FarAhead
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.loss import gain, unexplained
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.select.evidence import score, Scored, Weight
from leo_diffmodel.explain.unknown.curves import again, carry, Curve
from leo_diffmodel.explain.unknown.found_effect import expressible, FoundEffect
from leo_diffmodel.explain.unknown.influence import Influence, influence
from leo_diffmodel.explain.unknown.law import Law, law_of, table_of
from leo_diffmodel.explain.unknown.linear import linear_fit
from leo_diffmodel.explain.unknown.paths import with_past
from leo_diffmodel.explain.unknown.variables import variables
from leo_sim.effects.base import with_roles

Array = np.ndarray
LINEAR_SHARE = 0.5
REFINEMENTS, LINEAR = 3, 0.1
NEARLY = 3.0
"""Most that a law may leave, in units of noise, for its starts to be settled."""


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
        """The same with another fit."""
        at = self.scored.at._replace(fit=fitted)
        return replace(self, scored=replace(self.scored, at=at))

    def beside(self, base: Fit) -> Attempt:
        """The same with the very effects of a fit, of which another process gives copies."""
        hypothesis = base.hypothesis.with_candidate(self.candidate)
        return self.refitted(replace(self.fit, hypothesis=hypothesis))


def attempt(
    recordings: Sequence[Recording], posed: Posed, base: Fit, left: Influence, weight: Weight,
    curve: Curve,
) -> Attempt:
    """The law of a curve, fitted together with the base's own parameters."""
    law = law_of(left, curve, weight)
    if curve.variable.name == 'path':
        return beside(with_long_past(recordings, posed), base, left, law)
    made = beside(posed, base, left, law)
    if made.effect is None:
        return made
    made = _refined(made, base, weight)
    if curve.at_knots and _saved(made, base) < LINEAR_SHARE * curve.score.gain_train:
        whole = beside(posed, base, left, table_of(curve, weight))
        made = made if weight.ahead(made.scored, whole.scored) > 0 else whole
    return _on_the_ground(made)


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
        trace = _trace(left, law) / left.root
        made = linear_fit(posed.problem, base, hypothesis, theta, trace)
        return Attempt(law, left, score(Estimate(posed, made)))
    made = fit(posed.problem, hypothesis, theta, base.start)
    return Attempt(law, left, scored(Estimate(posed, made)))


def with_long_past(recordings: Sequence[Recording], posed: Posed) -> Posed:
    """The problem with as much history as a memory of the path needs."""
    short, longer = (p and replace(p, windows=with_past(recordings, p.windows))
                     for p in (posed.problem, posed.longer))  # fmt: skip
    assert short
    return replace(posed, problem=short, longer=longer)


def scored(at: Estimate) -> Scored:
    """A hypothesis with what it predicts of the folds left out, and far ahead."""
    return replace(score(at), ends=FarAhead().ends(at))


def _effect(left: Influence, law: Law, joint: str) -> Candidate:
    per_torque = in_volts(left.problem.base.robot, joint, 1.0) or 1.0
    effect = FoundEffect(law, joint, per_torque)
    return Candidate(effect, joint, with_roles(effect, law.parameters))


def _trace(left: Influence, law: Law) -> Array:
    """Change of the prediction by a law, weighted, shape (W, N)."""
    curve = law.curve
    carried = carry(left, curve.carrier, curve.joint)
    variable = next(v for v in variables(left, curve.joint) if v.kind == curve.variable.kind)
    return left.trace(law.at(variable.values) * carried, curve.joint)


def _saved(made: Attempt, base: Fit) -> float:
    return gain(base, made.fit, made.scored.at.problem.train)


def _refined(made: Attempt, base: Fit, weight: Weight) -> Attempt:
    """The law read again where it is nearly right, as often as that predicts better."""
    promised = float(made.law.curve.score.gain_train)
    if abs(_saved(made, base) - promised) < LINEAR * promised:
        return made
    for _ in range(REFINEMENTS):
        left = _around(made)
        if left.runs_away:
            break
        law = law_of(left, again(left, made.law.curve), weight)
        better = beside(made.scored.at.posed, base, made.left, law)
        if weight.ahead(better.scored, made.scored) <= 0:
            break
        made = better
    return made


def _around(made: Attempt) -> Influence:
    """What the base leaves, linearised where the law is in place."""
    law, hypothesis = made.fitted_law, made.fit.hypothesis
    left = influence(made.scored.at.problem, made.fit)
    first = hypothesis.offset(len(hypothesis.candidates) - 1)
    own = np.arange(first, first + len(law.values))
    return replace(left, residual=left.residual + _trace(left, law),
                   by_theta=np.delete(left.by_theta, own, axis=-1))  # fmt: skip


def _on_the_ground(made: Attempt) -> Attempt:
    """There a law that explains a good part when linearised is settled by itself."""
    at = made.scored.at
    if not at.problem.linearisation or unexplained(made.fit) > NEARLY:
        return made
    stand = converged(at.posed, made.fit)
    return replace(made, scored=scored(Estimate(stand.posed, stand.fit)))
