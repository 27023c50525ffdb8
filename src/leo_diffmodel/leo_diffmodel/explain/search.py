# SPDX-License-Identifier: Apache-2.0
"""Forward selection with joint refit, then backward elimination."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from leo_diffmodel.compare import noise
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.fit import Fit, fit, Problem
from leo_diffmodel.explain.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.scan import Scales, Scan, Scanner
from leo_diffmodel.explain.threshold import threshold

Array = np.ndarray
REFINED = 8
T = TypeVar('T')
AGREEMENT = 0.1
MARGIN_NATS = 5.0


@dataclass(frozen=True)
class Scored:
    """One candidate fitted on top of the present hypothesis.

    Attributes:
        candidate: the effect and its place.
        fit: the joint fit, None where the scan already ruled it out.
        gain_train: loss saved on the training windows [nats].
        gain_held_out: loss saved on the windows no fit saw [nats].
        evidence: what the largest amplitude tried could give in this data [nats].
        expected_held_out: what `gain_train` promises for the windows no fit saw [nats].
        dispersion: how many times what is left exceeds white noise; see `dispersion`.
    """

    candidate: Candidate
    fit: Fit | None
    gain_train: float
    gain_held_out: float
    evidence: float
    expected_held_out: float = 0.0
    dispersion: float = 1.0

    @property
    def confirmed(self) -> bool:
        """Whether held-out windows agree: they gain, and not a mere trace of what they should."""
        return self.gain_held_out > max(0.0, AGREEMENT * self.expected_held_out)

    @property
    def score(self) -> float:
        """Training gain less the price of its parameters (half a log of the sample count each).

        What is held out takes no part in the choice; it only has to agree.
        """
        if self.fit is None:
            return self.weight_of_evidence
        return self.weight_of_evidence - self.price

    @property
    def weight_of_evidence(self) -> float:
        """Training gain [nats] as it counts where the rest is more than white noise."""
        return self.gain_train / self.dispersion

    @property
    def total(self) -> float:
        """Gain on all windows [nats], discounted alike; the parameters saw the training ones."""
        return (self.gain_train + self.gain_held_out) / self.dispersion

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
        if not self.scored or self.scored[0].fit is None:
            return None
        top = self.scored[0]
        return top if top.total > self.threshold and top.confirmed else None


def gain(null: Fit, other: Fit, chosen: Array) -> float:
    """Robust loss saved on the chosen windows [nats]."""
    return float((null.loss - other.loss)[chosen].sum())


def dispersion(fitted: Fit) -> float:
    """How many times the residual exceeds white noise: its size times its correlation in time.

    1 in a bag whose model is right but for noise. On real data something unmodelled is always
    left; neighbouring samples then tell the same story, and a gain counts as much less.
    """
    joints = fitted.start.shape[-1] // 2
    angles = fitted.residual.reshape(len(fitted.residual), -1, 2 * joints)[..., :joints]
    ratio = unexplained(fitted)
    power = np.maximum((angles**2).sum(axis=(1, 2)), 1e-12)
    along = (angles[:, 1:] * angles[:, :-1]).sum(axis=(1, 2)) / power
    follow = min(max(float(np.median(along)), 0.0), 0.95)
    return max(1.0, ratio) * (1 + follow) / (1 - follow)


def unexplained(fitted: Fit) -> float:
    """Mean squared whitened residual over its expected value: 1 where only noise is left.

    The sum over a window of N channels with 2J free start states is chi-squared with N - 2J
    degrees of freedom (Pintelon, Schoukens and Vandersteen 1997); the median over windows
    keeps a hand push from deciding.
    """
    size, states = fitted.residual.shape[-1], fitted.start.shape[-1]
    return float(np.median((fitted.residual**2).sum(axis=-1)) / (size - states - 2 / 3))


def explore(
    problem: Problem,
    null: Fit,
    candidates: Sequence[Candidate],
    scales: Scales,
    short: Sequence[Windows],
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
    spread = min(dispersion(f) for f in leading)
    scored = [_score(problem, null, s, f, spread) for s, f in zip(scans, leading, strict=False)]
    rest = [
        Scored(s.candidate, None, s.gain, 0.0, s.evidence, dispersion=spread)
        for s in scans[REFINED:]
    ]
    return Round(null, (*_ranked(scored), *rest), threshold(scans), problem)


def _ranked(scored: Sequence[Scored]) -> list[Scored]:
    """Best first by training score; what training cannot separate, held-out data may."""
    ranked = sorted(scored, key=lambda s: -s.score)
    leader = ranked[0]
    margin = MARGIN_NATS * leader.dispersion
    tied = [
        s
        for s in ranked
        if leader.score - s.score < MARGIN_NATS
        and s.gain_held_out - leader.gain_held_out > margin
    ]
    if tied:
        first = max(tied, key=lambda s: s.gain_held_out)
        ranked.remove(first)
        ranked.insert(0, first)
    return ranked


def eliminate_backward(problem: Problem, full: Fit, limit: float) -> Fit:
    """Drop, one at a time, every effect whose removal costs less than `limit` nats."""
    everything = np.ones(problem.windows.count, dtype=bool)
    while len(full.hypothesis.candidates) > 1:
        smaller = [_without(problem, full, i) for i in range(len(full.hypothesis.candidates))]
        costs = [gain(s, full, everything) / dispersion(full) for s in smaller]
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
    """Fit from where the scan points; from neutral where that leads nowhere."""
    hypothesis: Hypothesis = null.hypothesis.with_candidate(scan.candidate)
    fitted = fit(problem, hypothesis, scan.theta, null.start)
    if gain(null, fitted, problem.train) >= 0:
        return fitted
    split = null.hypothesis.size - len(null.hypothesis.constants)
    neutral = [p.neutral for p in scan.candidate.parameters]
    theta = np.concatenate([null.theta[:split], neutral, null.theta[split:]])
    return fit(problem, hypothesis, theta, null.start, iterations=3)


def _score(problem: Problem, null: Fit, scan: Scan, fitted: Fit, spread: float) -> Scored:
    held, train = ~problem.train, problem.train
    trained = gain(null, fitted, train)
    return Scored(
        scan.candidate,
        fitted,
        trained,
        gain(null, fitted, held),
        scan.evidence,
        trained * held.sum() / max(train.sum(), 1),
        spread,
    )


def _least_noise(problem: Problem, leading: Sequence[Fit], short: Sequence[Windows]) -> Array:
    models = [f.hypothesis.model(problem.base, f.theta) for f in leading[:4]]
    return np.min([noise.estimate(m, short) for m in models], axis=0)


def _told(progress: Callable[[str], None], candidate: Candidate, result: T) -> T:
    progress(candidate.label)
    return result
