# SPDX-License-Identifier: Apache-2.0
"""Try a curve in earnest: its law as one effect more, fitted together with what a fit holds."""

from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.sizes import in_volts
from leo_diffmodel.compare.windows import Array, with_past
from leo_diffmodel.explain.estimate.covariance import covariance
from leo_diffmodel.explain.estimate.estimator import Estimate, far_ends, far_floor
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit, gain, unexplained
from leo_diffmodel.explain.estimate.ground_fit import converged
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.likelihood import degrees
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.select.evidence import score, Scored, Weight
from leo_diffmodel.explain.select.sets import Names
from leo_diffmodel.explain.unknown.curves import carry, Curve
from leo_diffmodel.explain.unknown.found_effect import expressible, FoundEffect
from leo_diffmodel.explain.unknown.influence import Influence, influence
from leo_diffmodel.explain.unknown.law import Law, law_of, table_of
from leo_sim.effects.base import with_roles


@dataclass(frozen=True)
class Attempt:
    """A law fitted together with named effects, as the last effect of a hypothesis."""

    law: Law  # as it was read
    left: Influence  # what it was read from
    base: Fit  # the named effects, fitted without it
    scored: Scored  # the hypothesis with it

    @property
    def fit(self) -> Fit:
        return self.scored.fit

    @property
    def candidate(self) -> Candidate:
        return self.fit.hypothesis.candidates[-1]

    @property
    def named(self) -> Names:
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
    def indices(self) -> Array:
        """Where the law's parameters are in `theta`."""
        first = self.fit.hypothesis.offset(len(self.fit.hypothesis.candidates) - 1)
        return np.arange(first, first + len(self.law.values))

    @property
    def fitted_law(self) -> Law:
        return self.law.settled(self.fit.theta[self.indices])

    @property
    def gain_train(self) -> float:
        """What it saves of the loss of its base on the training windows [nats]."""
        return gain(self.base, self.fit, self.scored.at.problem.train)

    @property
    def removed(self) -> float:
        """Share of the held-out loss beyond that of noise that the law removes."""
        validation, base = ~self.scored.at.problem.train, self.base
        before, after = (f.lost(validation) for f in (base, self.fit))
        noise = 0.5 * int(degrees(base.residual[validation], base.start.shape[-1]).sum())
        return float(np.clip((before - after) / max(before - noise, before - after, 1e-9), 0, 1))

    def refitted(self, fitted: Fit) -> 'Attempt':
        """This attempt with another fit of its hypothesis."""
        at = self.scored.at._replace(fit=fitted)
        return replace(self, scored=replace(self.scored, at=at))

    def beside(self, at: Estimate, base: Fit) -> 'Attempt':
        """This law in another fitted hypothesis that holds it, of which `base` has the rest."""
        held = at.fit.hypothesis.candidates
        last = sorted(range(len(held)), key=lambda i: held[i] == self.candidate)
        return judged(at._replace(fit=at.fit.reordered(last)), base, self.left, self.law)

    def on(self, base: Fit) -> 'Attempt':
        """This attempt with the very effects of a fit, of which another process gives copies."""
        hypothesis = base.hypothesis.with_candidate(self.candidate)
        return replace(self.refitted(replace(self.fit, hypothesis=hypothesis)), base=base)


def attempt(
    recordings: Recordings, posed: Posed, base: Fit, left: Influence, weight: Weight, curve: Curve
) -> Attempt:
    """The law of a curve, fitted together with the base's own parameters."""
    law = law_of(left, curve, weight)
    if curve.variable.name == 'path':
        return joined(_with_long_past(recordings, posed), base, left, law)
    made = joined(posed, base, left, law)
    if made.effect is None:
        return made
    made = _refined(made, weight)
    if not curve.hertz and made.gain_train < curve.score.gain_train:
        whole = joined(posed, base, left, table_of(curve))
        made = made if weight.ahead(made.scored, whole.scored) > 0 else whole
    return _on_the_ground(made)


def joined(
    posed: Posed, base: Fit, left: Influence, law: Law, candidate: Candidate | None = None
) -> Attempt:
    """A law, from its values, fitted together with what `base` holds.

    `candidate` is the law as an effect, where there is one already.
    """
    joint = left.model.robot.joint_names[law.curve.joint]
    hypothesis = base.hypothesis.with_candidate(candidate or _effect(left, law, joint))
    theta = base.with_values(law.values)
    if not expressible(law, joint):
        trace = _trace(left, law) / left.root
        linear = _linear_fit(posed.problem, base, hypothesis, theta, trace)
        return Attempt(law, left, base, score(Estimate(posed, linear)))
    fitted = fit(posed.problem, hypothesis, theta, base.start)
    return judged(Estimate(posed, fitted), base, left, law)


def judged(at: Estimate, base: Fit, left: Influence, law: Law) -> Attempt:
    """A hypothesis fitted with a law, by what it predicts of the folds left out."""
    made = scored(at)
    if law.read:  # what it saves in each fold because its curve was read from that fold, too
        curve, number = law.curve.score, np.unique(made.fold, return_inverse=True)[1]
        owed = (curve.fitted - curve.left_out) / np.bincount(number)
        made = replace(made, left=made.left + owed[number])
    return Attempt(law, left, base, made)


def scored(at: Estimate) -> Scored:
    """A hypothesis with what it predicts of the folds left out, and far ahead."""
    return replace(score(at), ends=far_ends(at, far_floor(at.posed)))


def _effect(left: Influence, law: Law, joint: str) -> Candidate:
    per_torque = in_volts(left.problem.base.robot, joint, 1.0) or 1.0
    effect = FoundEffect(law, joint, per_torque)
    return Candidate(effect, joint, with_roles(effect, law.parameters))


def _trace(left: Influence, law: Law) -> Array:
    """Change of the prediction by a law, weighted, shape (W, N)."""
    curve = law.curve
    torque = law.at(curve.seen_from(left).values) * carry(left, curve.carrier, curve.joint)
    return np.asarray((left.answer[..., curve.joint] @ torque[..., None])[..., 0])


def _linear_fit(problem: Problem, base: Fit, whole: Hypothesis, theta: Array, trace: Array) -> Fit:
    """A fit of a law, the last of `whole`, and what `base` holds, nothing simulated.

    The law's size alone is free, in place of its first parameter. `trace` (W, N) is what the law
    does to the prediction, initial states projected out.
    """
    first = base.hypothesis.first_constant
    places = [first] * (len(theta) - len(base.theta))
    columns = np.insert(base.columns, places, 0.0, axis=-1)
    columns[..., first] = -trace
    residual, channels, train = base.residual - trace, base.start.shape[-1], problem.train
    numerics, typical = problem.numerics, problem.typical_of(residual)
    block = np.arange(len(train)) if problem.block is None else problem.block
    spread = likelihood.dispersion(residual[train], channels)
    data = columns[train], residual[train], block[train]
    errors = covariance(*data, whole.prior(theta), spread, channels, numerics, typical)
    return replace(
        base,
        hypothesis=whole,
        theta=theta,
        covariance=errors,
        beyond=np.insert(base.beyond, places, 0.0, axis=0),
        columns=columns,
        loss=likelihood.loss(residual, channels, numerics, typical),
        residual=residual,
        typical=typical,
    )


def _refined(made: Attempt, weight: Weight) -> Attempt:
    """The law read again where it is nearly right, as often as that predicts better."""
    numerics, promised = made.scored.at.problem.numerics, float(made.law.curve.score.gain_train)
    if abs(made.gain_train - promised) < numerics.law_near * promised:
        return made
    for _ in range(numerics.law_refinements):
        left = _around(made)
        if left.runs_away:
            break
        law = law_of(left, made.law.curve.again(left), weight)
        better = joined(made.scored.at.posed, made.base, made.left, law)
        if weight.ahead(better.scored, made.scored) <= 0:
            break
        made = better
    return made


def _around(made: Attempt) -> Influence:
    """What is left without the law, linearised about the fit with it."""
    left = influence(made.scored.at.problem, made.fit)
    residual = left.residual + _trace(left, made.fitted_law)
    by_theta = np.delete(left.by_theta, made.indices, axis=-1)
    return replace(left, residual=residual, by_theta=by_theta)


def _on_the_ground(made: Attempt) -> Attempt:
    """On the ground a law that explains a good part when linearised is settled by itself."""
    at = made.scored.at
    if not at.problem.on_ground or unexplained(made.fit) > at.problem.numerics.law_nearly:
        return made
    settled = converged(at.posed, made.fit)
    return replace(made, scored=scored(Estimate(settled.posed, settled.fit)))


def _with_long_past(recordings: Recordings, posed: Posed) -> Posed:
    """The problem with as much history as a memory of the path needs."""

    def remembering(problem: Problem) -> Problem:
        past = problem.numerics.past_samples
        return replace(problem, windows=with_past(recordings, problem.windows, past))

    longer = posed.longer and remembering(posed.longer)
    return replace(posed, problem=remembering(posed.problem), longer=longer)
