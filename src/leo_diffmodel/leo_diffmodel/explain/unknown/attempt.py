# SPDX-License-Identifier: Apache-2.0
"""Try a curve in earnest: its law as an effect, fitted together with everything else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import Fit, gain, unexplained
from leo_diffmodel.explain.estimate.standing import converged
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.select.evidence import Weight
from leo_diffmodel.explain.unknown.beside import Attempt, beside, scored, trace_of
from leo_diffmodel.explain.unknown.curves import again, Curve
from leo_diffmodel.explain.unknown.influence import Influence, influence
from leo_diffmodel.explain.unknown.law import law_of, table_of
from leo_diffmodel.explain.unknown.paths import with_past


def attempt(
    recordings: Sequence[Recording],
    posed: Posed,
    base: Fit,
    left: Influence,
    weight: Weight,
    curve: Curve,
) -> Attempt:
    """The law of a curve, fitted together with the base's own parameters."""
    law = law_of(left, curve, weight)
    if curve.variable.name == 'path':
        return beside(_with_long_past(recordings, posed), base, left, law)
    made = beside(posed, base, left, law)
    if made.effect is None:
        return made
    made = _refined(made, base, weight)
    if curve.at_knots and _saved(made, base) < curve.score.gain_train:
        whole = beside(posed, base, left, table_of(curve))
        made = made if weight.ahead(made.scored, whole.scored) > 0 else whole
    return _on_the_ground(made)


def _with_long_past(recordings: Sequence[Recording], posed: Posed) -> Posed:
    """The problem with as much history as a memory of the path needs."""
    short, longer = (
        p and replace(p, windows=with_past(recordings, p.windows, p.numerics))
        for p in (posed.problem, posed.longer)
    )
    assert short
    return replace(posed, problem=short, longer=longer)


def _saved(made: Attempt, base: Fit) -> float:
    return gain(base, made.fit, made.scored.at.problem.train)


def _refined(made: Attempt, base: Fit, weight: Weight) -> Attempt:
    """The law read again where it is nearly right, as often as that predicts better."""
    numerics, promised = made.scored.at.problem.numerics, float(made.law.curve.score.gain_train)
    if abs(_saved(made, base) - promised) < numerics.law_near * promised:
        return made
    for _ in range(numerics.law_refinements):
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
    return replace(
        left,
        residual=left.residual + trace_of(left, law),
        by_theta=np.delete(left.by_theta, own, axis=-1),
    )


def _on_the_ground(made: Attempt) -> Attempt:
    """There a law that explains a good part when linearised is settled by itself."""
    at = made.scored.at
    if not at.problem.linearisation or unexplained(made.fit) > at.problem.numerics.law_nearly:
        return made
    stand = converged(at.posed, made.fit)
    return replace(made, scored=scored(Estimate(stand.posed, stand.fit)))
