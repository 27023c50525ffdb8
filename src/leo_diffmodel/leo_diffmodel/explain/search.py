# SPDX-License-Identifier: Apache-2.0
"""Forward selection with joint refit, then backward elimination."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.compare import noise
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.fit import Fit, fit, Problem
from leo_diffmodel.explain.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.scan import Scales, Scan, Scanner
from leo_diffmodel.explain.threshold import threshold

Array = np.ndarray
REFINED = 8


@dataclass(frozen=True)
class Scored:
    """One candidate fitted on top of the present hypothesis.

    Attributes:
        candidate: the effect and its place.
        fit: the joint fit, None where the scan already ruled it out.
        gain_train: loss saved on the training windows [nats].
        gain_held_out: loss saved on the windows no fit saw [nats].
        evidence: what the largest amplitude tried could give in this data [nats].
    """

    candidate: Candidate
    fit: Fit | None
    gain_train: float
    gain_held_out: float
    evidence: float

    @property
    def score(self) -> float:
        """Training gain less the price of its parameters (half a log of the sample count each).

        What is held out takes no part in the choice; it only has to agree.
        """
        if self.fit is None:
            return self.gain_train
        return self.gain_train - self.price

    @property
    def price(self) -> float:
        """Nats that the candidate's parameters must earn (Bayesian information criterion)."""
        assert self.fit is not None
        return 0.5 * len(self.candidate.parameters) * float(np.log(self.fit.residual.size))


@dataclass(frozen=True)
class Round:
    """One step of the search: all candidates on top of one hypothesis.

    Attributes:
        null: the fit the candidates were added to.
        scored: best first.
        threshold: gain [nats] that noise alone can give.
        problem: the problem with the noise used here.
    """

    null: Fit
    scored: tuple[Scored, ...]
    threshold: float
    problem: Problem

    @property
    def best(self) -> Scored | None:
        """The best candidate that the data support, if any."""
        top = self.scored[0] if self.scored else None
        supported = (
            top is not None
            and top.fit is not None
            and top.gain_train > self.threshold
            and top.gain_held_out > 0
        )
        return top if supported else None


def gain(null: Fit, other: Fit, chosen: Array) -> float:
    """Robust loss saved on the chosen windows [nats]."""
    return float((null.loss - other.loss)[chosen].sum())


def explore(
    problem: Problem,
    null: Fit,
    candidates: Sequence[Candidate],
    scales: Scales,
    short: Windows,
    progress: Callable[[str], None] = lambda _: None,
) -> Round:
    """Scan all candidates, refit the most promising, and settle the noise on the way.

    The noise is the least that any of the leading hypotheses leaves in short windows: a wrong
    model can only add to it.
    """
    scanner = Scanner(problem, null, scales)
    scans = [_told(progress, c, scanner.scan(c)) for c in candidates]
    scans.sort(key=lambda s: -s.gain)
    leading = [_told(progress, s.candidate, _refit(problem, null, s)) for s in scans[:REFINED]]
    calmer = _least_noise(problem, leading, short)
    if np.any(calmer < 0.97 * problem.sigma):
        quieter = replace(problem, sigma=np.minimum(calmer, problem.sigma))
        again = fit(quieter, null.hypothesis, null.theta, null.start)
        return explore(quieter, again, candidates, scales, short, progress)
    scored = [_score(problem, null, s, f) for s, f in zip(scans, leading, strict=False)]
    rest = [Scored(s.candidate, None, s.gain, 0.0, s.evidence) for s in scans[REFINED:]]
    ranked = sorted(scored, key=lambda s: -s.score) + rest
    return Round(null, tuple(ranked), threshold(scans), problem)


def eliminate_backward(problem: Problem, full: Fit, limit: float) -> Fit:
    """Drop, one at a time, every effect whose removal costs less than `limit` nats."""
    everything = np.ones(problem.windows.count, dtype=bool)
    while len(full.hypothesis.candidates) > 1:
        smaller = [_without(problem, full, i) for i in range(len(full.hypothesis.candidates))]
        costs = [gain(s, full, everything) for s in smaller]
        least = int(np.argmin(costs))
        if costs[least] > limit:
            break
        full = smaller[least]
    return full


def _without(problem: Problem, full: Fit, index: int) -> Fit:
    hypothesis, first = full.hypothesis, full.hypothesis.offset(index)
    count = len(hypothesis.candidates[index].parameters)
    theta = np.delete(full.theta, np.arange(first, first + count))
    return fit(problem, hypothesis.without(index), theta, full.start)


def _refit(problem: Problem, null: Fit, scan: Scan) -> Fit:
    hypothesis: Hypothesis = null.hypothesis.with_candidate(scan.candidate)
    return fit(problem, hypothesis, scan.theta, null.start)


def _score(problem: Problem, null: Fit, scan: Scan, fitted: Fit) -> Scored:
    held = ~problem.train
    return Scored(
        scan.candidate,
        fitted,
        gain(null, fitted, problem.train),
        gain(null, fitted, held),
        scan.evidence,
    )


def _least_noise(problem: Problem, leading: Sequence[Fit], short: Windows) -> Array:
    models = [f.hypothesis.model(problem.base, f.theta) for f in leading[:4]]
    return np.min([noise.estimate(m, short) for m in models], axis=0)


def _told(progress: Callable[[str], None], candidate: Candidate, result):  # type: ignore[no-untyped-def]
    progress(candidate.label)
    return result
