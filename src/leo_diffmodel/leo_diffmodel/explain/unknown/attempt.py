# SPDX-License-Identifier: Apache-2.0
"""Try a curve in earnest: its law as an effect, fitted together with everything else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.sizes import in_volts
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.loss import dispersion, gain
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.unknown.curves import again, carry, Curve
from leo_diffmodel.explain.unknown.found_effect import expressible, FoundEffect
from leo_diffmodel.explain.unknown.influence import Influence, influence
from leo_diffmodel.explain.unknown.law import Law, law_of, table_of
from leo_diffmodel.explain.unknown.paths import with_past
from leo_diffmodel.explain.unknown.variables import variables
from leo_sim.effects.base import with_roles

Array = np.ndarray


@dataclass(frozen=True)
class Attempt:
    """A law on top of a fit.

    Attributes:
        base: the fit without it.
        law: the law with its fitted values.
        fit: the joint fit; None for a law that no effect at one joint can hold: it is judged by
            the linear regression.
        effect: the law as an effect; None where none can hold it.
        gain_train: loss saved on the training windows [nats].
        gain_held_out: loss saved on the windows no fit saw [nats].
    """

    base: Fit
    law: Law
    fit: Fit | None
    effect: FoundEffect | None
    gain_train: float
    gain_held_out: float

    @property
    def dispersion(self) -> float:
        """How many times what is left exceeds white noise."""
        return dispersion(self.fit or self.base)


def attempt(
    recordings: Sequence[Recording], base: Fit, left: Influence, blocks: Array, curve: Curve
) -> Attempt:
    """The law of a curve, fitted together with the base's own parameters."""
    problem = left.problem
    law = law_of(left, blocks, curve)
    joint = problem.base.robot.joint_names[curve.joint]
    if not expressible(law, joint):
        return _linear(base, law)
    if curve.variable.name == 'path':
        problem = replace(problem, windows=with_past(recordings, problem.windows,
                                                      problem.numerics))  # fmt: skip
    made = _fitted(problem, base, law, joint)
    if curve.variable.name != 'path':
        made = _refined(made, problem, blocks, joint)
    promised = problem.numerics.law_linear * float(curve.score.gain_train)
    read_at_knots = curve.variable.name != 'path' and not curve.hertz
    if read_at_knots and made.gain_train < promised:
        whole = _fitted(problem, base, table_of(curve), joint)
        return max(made, whole, key=lambda a: a.gain_train)
    return made


def _refined(made: Attempt, problem: Problem, blocks: Array, joint: str) -> Attempt:
    """The law read again where it is nearly right, as often as that explains more."""
    promised, numerics = float(made.law.curve.score.gain_train), problem.numerics
    if abs(made.gain_train - promised) < numerics.law_near * promised:
        return made
    for _ in range(numerics.law_refinements):
        left = _around(problem, made)
        if left is None:
            break
        law = law_of(left, blocks, again(left, blocks, made.law.curve))
        better = _fitted(problem, made.base, law, joint)
        if better.gain_train <= made.gain_train:
            break
        made = better
    return made


def _around(problem: Problem, made: Attempt) -> Influence | None:
    """What the base leaves, linearised where the law is in place; None where it runs away."""
    assert made.fit is not None
    law, joint = made.law, made.law.curve.joint
    left = influence(problem, made.fit)
    if left.runs_away:
        return None
    carried = carry(left, law.curve.carrier, joint)
    variable = next(v for v in variables(left, joint) if v.kind == law.curve.variable.kind)
    assert carried is not None
    torque = (law.at(variable.values) * carried)[..., None]
    traced = (left.answer[..., joint] @ torque)[..., 0]
    first = made.fit.hypothesis.offset(len(made.fit.hypothesis.candidates) - 1)
    own = np.arange(first, first + len(law.values))
    rest = np.delete(left.by_theta, own, axis=-1)
    return replace(left, residual=left.residual + traced, by_theta=rest)


def _linear(base: Fit, law: Law) -> Attempt:
    score = law.curve.score
    return Attempt(base, law, None, None, float(score.gain_train), float(score.gain_held_out))


def _fitted(problem: Problem, base: Fit, law: Law, joint: str) -> Attempt:
    per_torque = in_volts(problem.base.robot, joint, 1.0) or 1.0
    effect = FoundEffect(law, joint, per_torque)
    candidate = Candidate(effect, joint, with_roles(effect, law.parameters))
    hypothesis = base.hypothesis.with_candidate(candidate)
    first = hypothesis.offset(len(hypothesis.candidates) - 1)
    theta = np.concatenate([base.theta[:first], law.values, base.theta[first:]])
    full = fit(problem, hypothesis, theta, base.start)
    return with_fit(Attempt(base, law, None, effect, 0.0, 0.0), full, problem)


def with_fit(tried: Attempt, full: Fit, problem: Problem | None = None) -> Attempt:
    """This law with the values of another joint fit, in which it is the last effect.

    Args:
        tried: the law.
        full: the fit.
        problem: what it was fitted to, to count anew what it gains.
    """
    if problem is not None:
        windows = problem.train, problem.judged
        trained, validated = (gain(tried.base, full, chosen) for chosen in windows)
        tried = replace(tried, gain_train=trained, gain_held_out=validated)
    assert tried.effect is not None
    first = full.hypothesis.offset(len(full.hypothesis.candidates) - 1)
    law = tried.law.settled(full.theta[first : first + len(tried.law.values)])
    effect = FoundEffect(law, tried.effect.joint, tried.effect.per_torque)
    return replace(tried, law=law, fit=full, effect=effect)

