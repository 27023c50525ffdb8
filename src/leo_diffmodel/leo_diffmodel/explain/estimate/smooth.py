# SPDX-License-Identifier: Apache-2.0
"""Estimator for motion without contact: every candidate scanned, the best refitted jointly.

Which two effects explain most together is found by the linear answer of what was scanned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
import time

import numpy as np

from leo_diffmodel.explain.estimate import helper
from leo_diffmodel.explain.estimate.estimator import (
    Estimate,
    Estimator,
    Extension,
    Progress,
    STEPS,
)
from leo_diffmodel.explain.estimate.finish import finished
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.scan import Scan, Scanner, stretch_limits, stretched, threshold
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import Numerics, Settings

Array = np.ndarray
Point = tuple[tuple[Candidate, ...], Array]


@dataclass
class Smooth(Estimator):
    """Fits by multiple shooting.

    Windows begin where the robot was measured, so what an effect does to them is nearly the same
    whatever else is in the model: of many candidates those are scanned again on top of others
    whose first answer still promises most.
    """

    _answers: dict[Candidate, Scan] = field(default_factory=dict, init=False)

    def first(self, hypothesis: Hypothesis) -> Estimate:
        """The model as given, with what is uncertain refitted."""
        return Estimate(self.posed, fit(self.posed.problem, hypothesis))

    def extended(
        self, base: Estimate, pool: Sequence[Candidate], progress: Progress, few: bool = False
    ) -> Extension:
        """Scan all, and refit the best alone and in pairs."""
        problem, numerics = base.problem, base.problem.numerics
        scanner = Scanner(problem, base.fit, self.scales)
        pool, others = self._promising(scanner, pool, numerics.rescanned)
        if others:
            progress(others[0].candidate.label, STEPS.scan * len(others))
        found = helper.spread_until(
            problem.until, scanner.scan, pool, lambda c: progress(c.label, STEPS.scan)
        )
        scans = [replace(s, candidate=pool[i]) for i, s in found.items()]
        scans.sort(key=lambda s: -s.gain)
        self._answers = {s.candidate: s for s in scans} | self._answers
        limit = threshold([*scans, *others], problem.settings)
        points = _singles(scans, limit, numerics)
        if scans and not few:
            pairs = numerics.pairs if base.names else numerics.first_pairs
            unlike = different(scans, scanner.residual, numerics)
            points += best_pairs(unlike, scanner.residual, pairs, limit, problem.settings)
        larger, untried = _fitted(base, points, progress)
        untried += [(c,) for i, c in enumerate(pool) if i not in found]
        return Extension(base, tuple(larger), tuple(scans), limit, tuple(untried))

    def _promising(
        self, scanner: Scanner, pool: Sequence[Candidate], most: int
    ) -> tuple[list[Candidate], list[Scan]]:
        """What is to be scanned, in the order of the pool, and earlier scans of the others."""
        earlier = [self._answers[c] for c in pool if c in self._answers]
        earlier.sort(key=scanner.promise, reverse=True)
        others = {s.candidate: s for s in earlier[max(0, most - len(pool) + len(earlier)) :]}
        return [c for c in pool if c not in others], list(others.values())

    def finished(self, at: Estimate, starts: Sequence[Array]) -> Estimate:
        """The least loss that several starts lead to."""
        return Estimate(at.posed, finished(at.problem, at.fit, starts))


def _singles(scans: Sequence[Scan], limit: float, numerics: Numerics) -> list[Point]:
    """The most promising effects, each with the values from which it is fitted."""
    least = numerics.worth * limit
    worth = [s for s in scans[: numerics.singles] if s.gain > least] or scans[:1]
    return [((s.candidate,), v) for s in worth for v in s.begins[: numerics.begins]]


def different(scans: Sequence[Scan], residual: Array, numerics: Numerics) -> list[Scan]:
    """Scans, best first, with different answers: of those alike, the first.

    `residual` is what their signatures are to explain, shape (M,).
    """
    kept: list[Scan] = []
    rows = np.zeros((0, len(residual)))
    for scan in scans:
        row = scan.signatures[int(np.argmax(scan.signatures @ residual))]
        if (np.abs(rows @ row) < numerics.parallel).all():
            kept.append(scan)
            rows = np.vstack([rows, row])
    return kept


def best_pairs(
    scans: Sequence[Scan], residual: Array, most: int, least: float, settings: Settings
) -> list[Point]:
    """The pairs of a leading effect and any other that save most, with the values where they do.

    Args:
        scans: of the candidates, best first.
        residual: what the signatures of the scans are to explain, shape (M,).
        most: how many pairs.
        least: by how many nats a pair must be better than the better of its two.
        settings: points of each that take part, which are too much alike, how far they reach.
    """
    atoms = _atoms(scans, residual, settings.numerics.pair_points)
    if len(atoms) < 2:
        return []
    owner = np.array([o for o, _ in atoms])
    rows = np.array([scans[o].signatures[k] for o, k in atoms])
    along = rows @ residual
    saved, stretch = _saved(along, rows @ rows.T, scans, atoms, settings)
    best = np.zeros(len(scans))
    np.maximum.at(best, owner, 0.5 * np.maximum(along, 0.0) ** 2)
    both = np.maximum(best[owner][:, None], best[owner][None, :])
    led = np.minimum(owner[:, None], owner[None, :]) < settings.numerics.leaders
    saved = np.where(led & (saved > both + least), saved, -np.inf)
    found: dict[frozenset[int], Point] = {}
    for flat in np.argsort(-saved, axis=None)[: settings.numerics.pair_looks * most]:
        i, j = map(int, np.unravel_index(flat, saved.shape))
        if not np.isfinite(saved[i, j]) or len(found) == most:
            break
        key = frozenset((atoms[i][0], atoms[j][0]))
        if len(key) == 2 and key not in found:
            by = float(stretch[i, j]), float(stretch[j, i])
            found[key] = _point(scans, (atoms[i], atoms[j]), by)
    return list(found.values())


def _atoms(scans: Sequence[Scan], residual: Array, most: int) -> list[tuple[int, int]]:
    """The points that explain most of each candidate, as numbers of scan and point."""
    found = []
    for number, scan in enumerate(scans):
        along = np.maximum(scan.signatures @ residual, 0.0)
        points = np.argsort(-along)[:most]
        found += [(number, int(k)) for k in points if scan.nats[k] > 0.5]
    return found


def _saved(
    along: Array,
    cosine: Array,
    scans: Sequence[Scan],
    atoms: Sequence[tuple[int, int]],
    settings: Settings,
) -> tuple[Array, Array]:
    """Nats that atoms i and j save together, and the stretch of i then; -inf where impossible."""
    free = np.where(np.abs(cosine) < settings.numerics.parallel, 1 - cosine**2, np.inf)
    share = (along[:, None] - cosine * along[None, :]) / free
    lengths = np.array([[np.sqrt(2 * scans[o].nats[k])] for o, k in atoms])
    stretch = share / lengths
    limits = np.array([stretch_limits(scans[o].candidate, settings.grids) for o, _ in atoms])
    able = (stretch >= 0.5 * limits[:, :1]) & (stretch <= 2 * limits[:, 1:])
    saved = 0.5 * (share * along[:, None] + share.T * along[None, :])
    return np.where(able & able.T, saved, -np.inf), np.clip(stretch, limits[:, :1], limits[:, 1:])


def _point(
    scans: Sequence[Scan], atoms: Sequence[tuple[int, int]], stretch: Sequence[float]
) -> Point:
    taken = [(scans[o], k, by) for (o, k), by in zip(atoms, stretch, strict=True)]
    values = [stretched(s.candidate, s.points[k], by) for s, k, by in taken]
    return tuple(s.candidate for s, _, _ in taken), np.concatenate(values)


def _fitted(
    base: Estimate, points: Sequence[Point], progress: Progress
) -> tuple[list[Estimate], list[tuple[Candidate, ...]]]:
    """A look from each point, all followed on, and what there was no time to look at.

    Where the time is limited half of what is left is for the looks.
    """
    null, problem = base.fit, base.problem
    half = 0.5 * (time.monotonic() + problem.until)

    def done(steps: int, candidates: Sequence[Candidate]) -> None:
        progress(' + '.join(c.label for c in candidates), steps)

    look = partial(_looked_at, problem, null)
    fits = helper.spread_until(half, look, points, lambda p: done(STEPS.look, p[0]))
    looked = list(fits)
    best = min((f.lost(problem.train) for f in fits.values()), default=np.inf)
    better = helper.spread_until(
        problem.until,
        partial(_followed, problem, best),
        list(fits.values()),
        lambda f: done(STEPS.fit, f.hypothesis.candidates),
    )
    fits |= {looked[i]: fitted for i, fitted in better.items()}
    own = {i: _with(null.hypothesis, points[i][0]) for i in fits}  # of copies of another process
    larger = [Estimate(base.posed, replace(f, hypothesis=own[i])) for i, f in fits.items()]
    return larger, [p[0] for i, p in enumerate(points) if i not in fits]


def _looked_at(problem: Problem, null: Fit, point: Point) -> Fit:
    """A first look from where a scan points; a fit from neutral where that leads nowhere."""
    added, values = point
    hypothesis, numerics = _with(null.hypothesis, added), problem.numerics
    near = partial(fit, problem, hypothesis, start=null.start, by_start=null.by_start)
    fitted = near(null.with_values(values), iterations=numerics.look)
    if fitted.lost(problem.train) <= null.lost(problem.train):
        return fitted
    parameters = [p for c in added for p in c.parameters]
    neutral = np.where([p.whole for p in parameters], values, [p.neutral for p in parameters])
    theta = null.with_values(neutral)
    return near(theta, iterations=numerics.neutral_look)


def _followed(problem: Problem, rival: float, fitted: Fit) -> Fit:
    near = partial(fit, problem, fitted.hypothesis, fitted.theta, fitted.start)
    return near(by_start=fitted.by_start, rival=rival)


def _with(hypothesis: Hypothesis, added: Sequence[Candidate]) -> Hypothesis:
    return replace(hypothesis, candidates=(*hypothesis.candidates, *added))
