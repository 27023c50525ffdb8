# SPDX-License-Identifier: Apache-2.0
"""Estimator for motion without contact: every candidate scanned, the best refitted jointly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from leo_diffmodel.explain.estimate import helper
from leo_diffmodel.explain.estimate.estimator import Estimate, Extension, Progress
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
        numerics = base.problem.numerics
        pairs = numerics.pairs if base.names else numerics.first_pairs
        larger, scans, limit = self._larger(base, pool, 0 if few else pairs, told)
        return Extension(base, tuple(larger), tuple(scans), limit)

    def _larger(
        self, base: Estimate, pool: Sequence[Candidate], pairs: int, told: Progress
    ) -> tuple[list[Estimate], list[Scan], float]:
        """Fits with one and with two more effects, the scans they come from, and the threshold."""
        null, problem, numerics = base.fit, base.problem, base.problem.numerics
        scanner = Scanner(problem, null, self.scales)
        scans = helper.spread(scanner.scan, pool, lambda c: told(c.label))
        scans = [replace(s, candidate=c) for s, c in zip(scans, pool, strict=True)]
        scans.sort(key=lambda s: -s.gain)
        limit = threshold(scans, problem.settings)
        worth = [s for s in scans[: numerics.singles]
                 if s.gain > numerics.worth * limit] or scans[:1]  # fmt: skip
        wholes = numerics.wholes
        points: list[Point] = [((s.candidate,), v) for s in worth
                               for v in (s.own, *s.others)[:wholes]]  # fmt: skip
        leaders = leading(scans, scanner.residual, numerics)
        points += best_pairs(leaders, scanner.residual, pairs, limit,
                             problem.settings)  # fmt: skip
        fits = helper.spread(partial(_looked_at, problem, null), points,
                             lambda p: told(' + '.join(c.label for c in p[0])))  # fmt: skip
        further = _leading(problem, fits)
        better = helper.spread(partial(_followed, problem), [fits[i] for i in further])
        for i, fitted in zip(further, better, strict=True):
            fits[i] = fitted
        named = [_named(f, null, p[0]) for f, p in zip(fits, points, strict=True)]
        return [Estimate(base.posed, f) for f in named], scans, limit

    def refitted(self, at: Estimate, hypothesis: Hypothesis, theta: Array | None = None
                 ) -> Estimate:
        """Another hypothesis on the same windows; see `Estimator`."""
        return Estimate(at.posed, fit(at.problem, hypothesis, theta, at.fit.start))

    def finished(self, at: Estimate, starts: Sequence[Array]) -> Estimate:
        """The least loss that several starts lead to; see `Estimator`."""
        return Estimate(at.posed, finished(at.problem, at.fit, starts))


def _looked_at(problem: Problem, null: Fit, point: Point) -> Fit:
    """A first look from where a scan points; a fit from neutral where that leads nowhere."""
    added, values = point
    hypothesis = _with(null.hypothesis, added)
    fitted = fit(problem, hypothesis, _between(null, values), null.start,
                 problem.numerics.look)  # fmt: skip
    if fitted.loss[problem.train].sum() <= null.loss[problem.train].sum():
        return fitted
    parameters = [p for c in added for p in c.parameters]
    neutral = np.where([p.whole for p in parameters], values, [p.neutral for p in parameters])
    return fit(problem, hypothesis, _between(null, neutral), null.start,
               problem.numerics.neutral_look)  # fmt: skip


def _leading(problem: Problem, fits: Sequence[Fit]) -> list[int]:
    """The better half of the fits, of those with one effect more and of those with two."""
    loss = [float(f.loss[problem.train].sum()) for f in fits]
    sizes = [len(f.hypothesis.candidates) for f in fits]
    kinds = [[i for i, s in enumerate(sizes) if s == size] for size in sorted(set(sizes))]
    return [i for kind in kinds
            for i in sorted(kind, key=loss.__getitem__)[: (len(kind) + 1) // 2]]  # fmt: skip


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
