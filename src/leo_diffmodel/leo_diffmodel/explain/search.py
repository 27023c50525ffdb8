# SPDX-License-Identifier: Apache-2.0
"""One step of the search: every candidate on top of one hypothesis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from leo_diffmodel.compare import noise
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain import helper
from leo_diffmodel.explain.contest import contest
from leo_diffmodel.explain.fit import Fit, fit, moved, Problem, settled_as
from leo_diffmodel.explain.ground_scan import GroundScanner
from leo_diffmodel.explain.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.pose import Posed, quieter, resettled
from leo_diffmodel.explain.scan import Scales, Scan, Scanner
from leo_diffmodel.explain.scored import dispersion, MARGIN_NATS, Scored
from leo_diffmodel.explain.shooting import robust_weight
from leo_diffmodel.explain.threshold import threshold

Array = np.ndarray
REFINED = 8
MOST_ON_FOOTING, WORTH = 8, 0.2
KNOCK_OUT, KNOCK_OUT_WINDOWS = (4, 2), 50
"""How many go on after each step, and in how many windows."""
STRIDES = (1.0, 0.3)
MOST_FOOTINGS, GAINED = 6, 2.0
WINDOW_NATS = 6.0
"""Most that one window on the ground may say: a contact there may flip either way."""
LISTENED = 3
WORTH_A_FIT = 1.5
EQUAL_NATS = 1.0


@dataclass(frozen=True)
class Round:
    """One step of the search: all candidates on top of one hypothesis.

    Attributes:
        null: the fit the candidates were added to.
        scored: best first.
        threshold: gain [nats] that noise alone can give.
        posed: the problem with the noise used here.
    """

    null: Fit
    scored: tuple[Scored, ...]
    threshold: float
    posed: Posed

    def of(self, candidate: Candidate) -> Scored:
        """A candidate of this round."""
        return next(s for s in self.scored if s.candidate == candidate)

    @property
    def best(self) -> Scored | None:
        """The best candidate that the data support, if any."""
        if not self.scored or self.scored[0].fit is None:
            return None
        top = self.scored[0]
        return top if top.total > self.threshold and top.confirmed else None


def gain(null: Fit, other: Fit, chosen: Array, most: float = np.inf) -> float:
    """Robust loss saved on the chosen windows [nats], at most so much on each."""
    return float(np.clip(null.loss - other.loss, -most, most)[chosen].sum())


def explore(
    posed: Posed,
    null: Fit,
    candidates: Sequence[Candidate],
    scales: Scales,
    short: Sequence[Windows],
    progress: Callable[[str], None] = lambda _: None,
    incumbent: Fit | None = None,
) -> Round:
    """Scan all candidates, refit the most promising, and settle the noise on the way.

    The noise is the least that any of the leading hypotheses leaves in short windows: a wrong
    model can only add to it.

    Args:
        posed: the problem.
        null: the hypothesis to add to.
        candidates: what to add.
        scales: sizes of this robot and data.
        short: the windows that noise is read from.
        progress: told what is being tried.
        incumbent: a fit of the hypothesis with one of the candidates; it is tried from there.
    """
    if posed.problem.footing:
        posed, null = _converged(posed, null)
    problem = posed.problem
    scanner = (GroundScanner if problem.footing else Scanner)(problem, null, scales)
    found = helper.spread(scanner.scan, candidates, lambda c: progress(c.label))
    scans = [replace(s, candidate=c) for s, c in zip(found, candidates, strict=True)]
    scans = _ordered(scans, null, incumbent)
    if problem.footing:
        return on_footing(posed, null, scans, threshold(scans), candidates, progress)
    leading = _refitted(problem, null, scans[:LISTENED], progress)
    calmer = np.minimum(_least_noise(problem, leading, short), problem.sigma)
    if np.any(calmer < 0.97 * problem.sigma):
        calm = quieter(posed, calmer)
        again = fit(calm.problem, null.hypothesis, null.theta, null.start)
        return explore(calm, again, candidates, scales, short, progress, incumbent)
    rest = [s for s in scans[LISTENED:REFINED] if s.gain > WORTH_A_FIT]
    leading += _refitted(problem, null, rest, progress)
    return _ranking(posed, null, scans, leading, threshold(scans), candidates)


def on_footing(
    posed: Posed,
    null: Fit,
    scans: Sequence[Scan],
    limit: float,
    candidates: Sequence[Candidate],
    progress: Callable[[str], None] = lambda _: None,
) -> Round:
    """A round on the ground, where a fit is dear: a knock-out of what the scan promises most.

    Each has its own footing from the first step on; that of the model without it favours small
    effects. Those ahead after a step in some windows go on; the last are fitted in all.
    """
    worth = [s for s in scans[:MOST_ON_FOOTING] if s.gain > WORTH * limit] or scans[:1]
    some = np.flatnonzero(posed.problem.train)
    some = some[np.linspace(0, len(some) - 1, min(KNOCK_OUT_WINDOWS, len(some))).astype(int)]
    part, there = posed.take(some), null.take(some)
    field = [(s, *_footed(part, _with(there, s))) for s in worth]
    for left in KNOCK_OUT:
        field = [(s, *_advanced(at, fitted)) for s, at, fitted in field]
        field.sort(key=lambda entry: -gain(there, entry[2], part.problem.train, WINDOW_NATS))
        field = field[:left]
        progress(field[0][0].candidate.label)
    last = [_converged(posed, _with(null, replace(s, theta=f.theta))) for s, _, f in field]
    first = [s for s, *_ in field]
    rest = [s for s in scans if not any(s is f for f in first)]
    best = max(last, key=lambda found: gain(null, found[1], posed.problem.train, WINDOW_NATS))
    return _ranking(best[0], null, [*first, *rest], [f for _, f in last], limit, candidates)


def _with(null: Fit, scan: Scan) -> Fit:
    """The candidate of a scan beside the others, at its values; not fitted."""
    hypothesis = null.hypothesis.with_candidate(scan.candidate)
    return replace(null, hypothesis=hypothesis, theta=hypothesis.bounded(scan.theta))


def _advanced(posed: Posed, fitted: Fit) -> tuple[Posed, Fit]:
    """A step further, or a shorter one, where that is better."""
    for scale in STRIDES:
        trial_posed, trial = _footed(posed, moved(posed.problem, fitted, scale))
        if gain(fitted, trial, posed.problem.train, WINDOW_NATS) > 0:
            return trial_posed, trial
    return posed, fitted


def _converged(posed: Posed, best: Fit) -> tuple[Posed, Fit]:
    """A hypothesis fitted with the starts settled anew at every step, and the footing there."""
    posed, best = _footed(posed, best)
    scale = 1.0
    for _ in range(MOST_FOOTINGS if best.hypothesis.size else 0):
        trial_posed, trial = _footed(posed, moved(posed.problem, best, scale))
        gained = gain(best, trial, posed.problem.train, WINDOW_NATS)
        if gained <= 0:
            scale *= 0.3
            continue
        posed, best, scale = trial_posed, trial, min(1.0, 3 * scale)
        if gained < GAINED:
            break
    return posed, best


def _footed(posed: Posed, point: Fit) -> tuple[Posed, Fit]:
    """The footing at some values, and the hypothesis there."""
    posed = resettled(posed, point)
    return posed, fit(posed.problem, point.hypothesis, point.theta, iterations=0)


def _ranking(
    posed: Posed,
    null: Fit,
    scans: Sequence[Scan],
    leading: Sequence[Fit],
    limit: float,
    candidates: Sequence[Candidate],
) -> Round:
    """The round in which the first of the scans led to the fits `leading`."""
    if posed.problem.footing:
        for other in leading:
            null = settled_as(posed.problem, null, other)
    spread = min(dispersion(f) for f in leading)
    pairs = zip(scans, leading, strict=False)
    scored = [_score(posed.problem, null, s, f, spread) for s, f in pairs]
    if max(s.total for s in scored) > limit:
        scored = contest(posed.longer, scored)
    out = [
        Scored(s.candidate, None, s.gain, 0.0, s.evidence, dispersion=spread)
        for s in scans[len(leading) :]
    ]
    return Round(null, (*_ranked(scored, candidates), *out), limit, posed)


def _ordered(scans: Sequence[Scan], null: Fit, incumbent: Fit | None) -> list[Scan]:
    """The most promising first, the incumbent with its fitted values before all."""
    ordered = sorted(scans, key=lambda s: -s.gain)
    if incumbent is None:
        return ordered
    first = next(s for s in ordered if s.candidate in incumbent.hypothesis.candidates)
    hypothesis = null.hypothesis.with_candidate(first.candidate)
    theta = hypothesis.carried(incumbent.hypothesis, incumbent.theta)
    return [replace(first, theta=theta), *(s for s in ordered if s is not first)]


def _ranked(scored: Sequence[Scored], candidates: Sequence[Candidate]) -> list[Scored]:
    """Best first by training score, those that held-out data refute behind the others.

    What training cannot separate, held-out data may; of what nothing can, the first in the
    catalogue leads.
    """
    ranked = sorted(scored, key=lambda s: (not s.confirmed, -s.score))
    leader = ranked[0]
    margin = MARGIN_NATS * leader.dispersion
    tied = [
        s
        for s in ranked
        if leader.score - s.score < MARGIN_NATS
        and s.gain_held_out - leader.gain_held_out > margin
    ]
    equal = [
        s
        for s in ranked
        if leader.score - s.score < EQUAL_NATS and s.confirmed == leader.confirmed
    ]
    first = min(equal, key=lambda s: candidates.index(s.candidate))
    if tied:
        first = max(tied, key=lambda s: s.gain_held_out)
    return [first, *(s for s in ranked if s is not first)]


def _refitted(
    problem: Problem, null: Fit, scans: Sequence[Scan], progress: Callable[[str], None]
) -> list[Fit]:
    points = [(s.candidate, s.theta) for s in scans]
    fits = helper.spread(partial(_refit, problem, null), points, lambda p: progress(p[0].label))
    return [
        replace(f, hypothesis=null.hypothesis.with_candidate(s.candidate))
        for f, s in zip(fits, scans, strict=True)
    ]


def _refit(problem: Problem, null: Fit, point: tuple[Candidate, Array]) -> Fit:
    """Fit from where a scan points; from neutral where that leads nowhere."""
    candidate, theta = point
    hypothesis: Hypothesis = null.hypothesis.with_candidate(candidate)
    fitted = fit(problem, hypothesis, theta, null.start)
    if gain(null, fitted, problem.train) >= 0:
        return fitted
    split = null.hypothesis.size - len(null.hypothesis.constants)
    neutral = [p.neutral for p in candidate.parameters]
    theta = np.concatenate([null.theta[:split], neutral, null.theta[split:]])
    return fit(problem, hypothesis, theta, null.start, iterations=3)


def _score(problem: Problem, null: Fit, scan: Scan, fitted: Fit, spread: float) -> Scored:
    held, train = ~problem.train, problem.train
    most = WINDOW_NATS if problem.footing else np.inf
    trained = gain(null, fitted, train, most)
    weight = robust_weight(null.residual)
    trace = (weight * (null.residual - fitted.residual) ** 2).sum(axis=-1)
    return Scored(
        scan.candidate,
        fitted,
        trained,
        gain(null, fitted, held, most),
        scan.evidence,
        trained * float(trace[held].sum() / max(trace[train].sum(), 1e-12)),
        spread,
    )


def _least_noise(problem: Problem, leading: Sequence[Fit], short: Sequence[Windows]) -> Array:
    models = [f.hypothesis.model(problem.base, f.theta) for f in leading]
    return np.min([noise.estimate(m, short) for m in models], axis=0)
