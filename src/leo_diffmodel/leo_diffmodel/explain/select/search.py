# SPDX-License-Identifier: Apache-2.0
"""One step of the search: every candidate on top of one hypothesis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from leo_diffmodel.compare import noise
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.estimate import helper
from leo_diffmodel.explain.estimate.fit import Fit, fit, Problem
from leo_diffmodel.explain.estimate.ground_scan import GroundScanner
from leo_diffmodel.explain.estimate.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.estimate.on_ground import converged, knock_out
from leo_diffmodel.explain.estimate.scan import amplitude_indices, Scales, Scan, Scanner
from leo_diffmodel.explain.problem.pose import Posed, quieter
from leo_diffmodel.explain.select.ranking import gain, ranking, Round
from leo_diffmodel.explain.select.scored import away, shows
from leo_diffmodel.explain.estimate.threshold import threshold

Array = np.ndarray
REFINED = 8
LISTENED = 3
WORTH_A_FIT = 1.5


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
        posed, null, _ = converged(posed, null)
    problem = posed.problem
    scanner = (GroundScanner if problem.footing else Scanner)(problem, null, scales)
    found = _scanned(scanner, candidates, lambda c: progress(c.label))
    found = [replace(s, candidate=c) for s, c in zip(found, candidates, strict=True)]
    scans = _ordered(found, null, incumbent)
    if problem.footing:
        scans[1:1] = scanned_anew(found, null, incumbent)
        return knock_out(posed, null, scans, threshold(scans), candidates, progress)
    leading = _refitted(problem, null, scans[:LISTENED], progress)
    calmer = np.minimum(_least_noise(problem, leading, short), problem.sigma)
    if np.any(calmer < 0.97 * problem.sigma):
        calm = quieter(posed, calmer)
        again = fit(calm.problem, null.hypothesis, null.theta, null.start)
        return explore(calm, again, candidates, scales, short, progress, incumbent)
    rest = [s for s in scans[LISTENED:REFINED] if s.gain > WORTH_A_FIT]
    leading += _refitted(problem, null, rest, progress)
    return ranking(posed, null, scans, leading, threshold(scans), candidates)


def _scanned(
    scanner: Scanner, candidates: Sequence[Candidate], told: Callable[[Candidate], None]
) -> list[Scan]:
    """All candidates scanned; the scanner on the ground keeps what takes long."""
    if not isinstance(scanner, GroundScanner):
        return helper.spread(scanner.scan, candidates, told)
    scanner.trace(candidates, told)
    return [scanner.scan(candidate) for candidate in candidates]


def _ordered(scans: Sequence[Scan], null: Fit, incumbent: Fit | None) -> list[Scan]:
    """The most promising first, the incumbent with its fitted values before all."""
    ordered = sorted(scans, key=lambda s: -s.gain)
    if incumbent is None:
        return ordered
    first = next(s for s in ordered if s.candidate in incumbent.hypothesis.candidates)
    hypothesis = null.hypothesis.with_candidate(first.candidate)
    theta = hypothesis.carried(incumbent.hypothesis, incumbent.theta)
    return [replace(first, theta=theta), *(s for s in ordered if s is not first)]


def scanned_anew(scans: Sequence[Scan], null: Fit, incumbent: Fit | None) -> list[Scan]:
    """The scan of an incumbent with a parameter that does not show at its fitted values.

    No fit finds the way back from there.
    """
    if incumbent is None:
        return []
    mine = [s for s in scans if s.candidate in incumbent.hypothesis.candidates]
    return [_sized(s, null, incumbent) for s in mine if not shows(incumbent, s.candidate)]


def _sized(scan: Scan, null: Fit, incumbent: Fit) -> Scan:
    """A scan brought to the fitted size of its effect, if that shows."""
    hypothesis = null.hypothesis.with_candidate(scan.candidate)
    first, theta = hypothesis.offset(len(hypothesis.candidates) - 1), scan.theta.copy()
    scaling = [first + i for i in amplitude_indices(scan.candidate.parameters)]
    beyond = theta - hypothesis.neutral
    fitted = hypothesis.carried(incumbent.hypothesis, incumbent.theta) - hypothesis.neutral
    if beyond[first] and away(incumbent, scan.candidate)[0] >= 1:
        theta[scaling] += beyond[scaling] * (fitted[first] / beyond[first] - 1)
    return replace(scan, theta=theta)


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


def _least_noise(problem: Problem, leading: Sequence[Fit], short: Sequence[Windows]) -> Array:
    models = [f.hypothesis.model(problem.base, f.theta) for f in leading]
    return np.min([noise.estimate(m, short) for m in models], axis=0)
