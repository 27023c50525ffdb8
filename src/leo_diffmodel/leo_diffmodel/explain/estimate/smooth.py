# SPDX-License-Identifier: Apache-2.0
"""Estimator for motion without contact: every candidate scanned, the best refitted jointly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
import time

import numpy as np

from leo_diffmodel.explain.estimate import helper
from leo_diffmodel.explain.estimate.estimator import Estimate, Extension, Progress, STEPS
from leo_diffmodel.explain.estimate.far_ahead import FarAhead
from leo_diffmodel.explain.estimate.finish import finished
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.pairs import best_pairs, leading
from leo_diffmodel.explain.estimate.scan import Scales, Scan, Scanner
from leo_diffmodel.explain.estimate.threshold import threshold
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import Numerics

Array = np.ndarray
Point = tuple[tuple[Candidate, ...], Array]


@dataclass
class Smooth(FarAhead):
    """Fits by multiple shooting; see `Estimator`."""

    posed: Posed
    scales: Scales

    def first(self, hypothesis: Hypothesis) -> Estimate:
        """The model as given, with what is uncertain refitted."""
        return Estimate(self.posed, fit(self.posed.problem, hypothesis))

    def extended(
        self, base: Estimate, pool: Sequence[Candidate], told: Progress, few: bool = False
    ) -> Extension:
        """Scan all, and refit the best alone and in pairs; see `Estimator`."""
        problem, numerics = base.problem, base.problem.numerics
        pairs = numerics.pairs if base.names else numerics.first_pairs
        scanner = Scanner(problem, base.fit, self.scales)
        found = helper.spread_until(
            problem.until, scanner.scan, pool, lambda c: told(c.label, STEPS.scan)
        )
        scans = [replace(s, candidate=pool[i]) for i, s in found.items()]
        scans.sort(key=lambda s: -s.gain)
        limit = threshold(scans, problem.settings)
        points = _singles(scans, limit, numerics)
        leaders = leading(scans, scanner.residual, numerics) if scans else []
        points += best_pairs(
            leaders, scanner.residual, 0 if few else pairs, limit, problem.settings
        )
        larger, untried = _fitted(base, points, told)
        untried += [(c,) for i, c in enumerate(pool) if i not in found]
        return Extension(base, tuple(larger), tuple(scans), limit, tuple(untried))

    def refitted(
        self, at: Estimate, hypothesis: Hypothesis, theta: Array | None = None
    ) -> Estimate:
        """Another hypothesis on the same windows; see `Estimator`."""
        return Estimate(at.posed, fit(at.problem, hypothesis, theta, at.fit.start))

    def finished(self, at: Estimate, starts: Sequence[Array]) -> Estimate:
        """The least loss that several starts lead to; see `Estimator`."""
        return Estimate(at.posed, finished(at.problem, at.fit, starts))


def _singles(scans: Sequence[Scan], limit: float, numerics: Numerics) -> list[Point]:
    """The most promising effects, each with the values from which it is fitted."""
    least = numerics.worth * limit
    worth = [s for s in scans[: numerics.singles] if s.gain > least] or scans[:1]
    return [((s.candidate,), v) for s in worth for v in (s.own, *s.others)[: numerics.wholes]]


def _fitted(
    base: Estimate, points: Sequence[Point], told: Progress
) -> tuple[list[Estimate], list[tuple[Candidate, ...]]]:
    """A look from each point, the better half followed on, and what there was no time to look at.

    Where the time is limited half of what is left is for the looks.
    """
    null, problem = base.fit, base.problem
    half = 0.5 * (time.monotonic() + problem.until)
    fits = helper.spread_until(
        half, partial(_looked_at, problem, null), points, lambda p: told(_label(p[0]), STEPS.look)
    )
    further = _leading(problem, fits)
    better = helper.spread_until(
        problem.until,
        partial(_followed, problem),
        [fits[i] for i in further],
        lambda f: told(_label(f.hypothesis.candidates), STEPS.fit),
    )
    fits |= {further[i]: fitted for i, fitted in better.items()}
    named = [Estimate(base.posed, _named(f, null, points[i][0])) for i, f in fits.items()]
    return named, [p[0] for i, p in enumerate(points) if i not in fits]


def _label(candidates: Sequence[Candidate]) -> str:
    return ' + '.join(c.label for c in candidates)


def _looked_at(problem: Problem, null: Fit, point: Point) -> Fit:
    """A first look from where a scan points; a fit from neutral where that leads nowhere."""
    added, values = point
    hypothesis = _with(null.hypothesis, added)
    fitted = fit(problem, hypothesis, _between(null, values), null.start, problem.numerics.look)
    if fitted.loss[problem.train].sum() <= null.loss[problem.train].sum():
        return fitted
    parameters = [p for c in added for p in c.parameters]
    neutral = np.where([p.whole for p in parameters], values, [p.neutral for p in parameters])
    return fit(
        problem, hypothesis, _between(null, neutral), null.start, problem.numerics.neutral_look
    )


def _leading(problem: Problem, fits: Mapping[int, Fit]) -> list[int]:
    """The better half of the fits, of those with one effect more and of those with two."""
    loss = {i: float(f.loss[problem.train].sum()) for i, f in fits.items()}
    sizes = {i: len(f.hypothesis.candidates) for i, f in fits.items()}
    kinds = [[i for i, s in sizes.items() if s == size] for size in sorted({*sizes.values()})]
    return [
        i for kind in kinds for i in sorted(kind, key=loss.__getitem__)[: (len(kind) + 1) // 2]
    ]


def _followed(problem: Problem, fitted: Fit) -> Fit:
    """A fit that looked promising, followed on."""
    return fit(problem, fitted.hypothesis, fitted.theta, fitted.start)


def _between(null: Fit, values: Array) -> Array:
    """Parameters of a hypothesis with these values after those of the effects it holds."""
    split = null.hypothesis.size - len(null.hypothesis.constants)
    return np.concatenate([null.theta[:split], values, null.theta[split:]])


def _with(hypothesis: Hypothesis, added: Sequence[Candidate]) -> Hypothesis:
    for candidate in added:
        hypothesis = hypothesis.with_candidate(candidate)
    return hypothesis


def _named(fitted: Fit, null: Fit, added: Sequence[Candidate]) -> Fit:
    """The fit with the very candidates asked for, of which another process gives copies."""
    return replace(fitted, hypothesis=_with(null.hypothesis, added))
