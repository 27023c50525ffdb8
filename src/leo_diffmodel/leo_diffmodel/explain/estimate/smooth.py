# SPDX-License-Identifier: Apache-2.0
"""Estimator for motion without contact: all effects in one linear problem about each fit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate import trials
from leo_diffmodel.explain.estimate.background import background
from leo_diffmodel.explain.estimate.choice import price_of, rivals
from leo_diffmodel.explain.estimate.estimator import (
    as_fitted,
    Estimate,
    Estimator,
    Extension,
    FIT,
    most_floors,
    Progress,
    steps_ahead,
    Widened,
)
from leo_diffmodel.explain.estimate.finish import finished
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import dispersion, Fit
from leo_diffmodel.explain.estimate.matrices import Matrices, matrices
from leo_diffmodel.explain.estimate.rounds import Rounds
from leo_diffmodel.explain.problem.hypothesis import Candidate, compatible, Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_msgs_py.console import listed, Reporter

Point = tuple[Hypothesis, Array]


@dataclass
class Smooth(Estimator):
    """Fits by multiple shooting, from where linear algebra says that it begins."""

    _made: tuple[Fit, Matrices] | None = field(default=None, init=False)

    def first(self, hypothesis: Hypothesis) -> Estimate:
        return Estimate(self.posed, fit(self.posed.problem, hypothesis))

    def begun(
        self,
        first: Estimate,
        recordings: Sequence[Recording],
        pool: Sequence[Candidate],
        progress: Reporter,
        near: Fit | None = None,
        hear: Callable[[Estimate], None] = lambda _: None,
    ) -> Estimate:
        progress.expect(steps_ahead(first.problem.numerics, len(pool), rounds=3))
        return Rounds(self, first, pool, progress).of(recordings, near, hear)

    def near(
        self, base: Estimate, pool: Sequence[Candidate], progress: Reporter, rival: float = np.inf
    ) -> Extension:
        """The sets that linear algebra finds best, fitted jointly."""
        problem, made = base.problem, self._matrices(base, pool, progress)
        near = problem.gates.told_nats * dispersion(base.fit)
        terms = rivals(made, price_of(problem, base.fit, made), problem.settings, near)
        points = self._shown(base, [*map(made.hypothesis, terms)])
        if len(base.names) <= problem.gates.many:
            return _fitted_all(base, made, points, progress, rival)
        one_each = {frozenset(p[0].candidates): p for p in reversed(points)}
        first = [*one_each.values()][::-1]
        return _fitted_all(base, made, first, progress, rival, problem.numerics.patience)

    def with_each(
        self, base: Estimate, pool: Sequence[Candidate], progress: Progress
    ) -> Extension:
        """Each effect of a pool beside a fitted hypothesis, from where linear algebra points."""
        able = [c for c in pool if compatible(base.names, c)]
        made = matrices(base.problem, base.fit, self.scales, able, progress)
        begins = base.problem.numerics.begins
        points = []
        for candidate in able:
            own = {t.fixed: t for t in made.others if t.candidate == candidate}
            points += [made.hypothesis([*made.members, t]) for t in [*own.values()][:begins]]
        return _fitted_all(base, made, points, progress)

    def _shown(self, base: Estimate, points: list[Point]) -> list[Point]:
        """The sets less those of which nobody sees far ahead what they have more than a fit."""
        if not base.names:
            return points
        gates, own = base.problem.gates, self.ends(base)
        least = gates.few_floors * gates.least_floors

        def seen(hypothesis: Hypothesis, theta: Array) -> bool:
            more = base._replace(fit=replace(base.fit, hypothesis=hypothesis, theta=theta))
            is_part = base.names <= {*hypothesis.candidates}
            return not (is_part and most_floors(self.ends(more) - own) < least)

        return [p for p in points if seen(*p)]

    def doubt(self, at: Estimate, pool: Sequence[Candidate], progress: Reporter) -> Widened:
        if at.problem.late():
            return as_fitted
        made, spread = self._matrices(at, pool, progress), dispersion(at.fit)
        return background(made, at.fit.hypothesis.candidates, spread).widened

    def _matrices(self, at: Estimate, pool: Sequence[Candidate], progress: Reporter) -> Matrices:
        if self._made is None or self._made[0] is not at.fit:
            made = matrices(at.problem, at.fit, self.scales, pool, progress)
            self._made = at.fit, made
        return self._made[1]

    def finished(
        self, at: Estimate, starts: Sequence[Array], progress: Progress, wide: Widened = as_fitted
    ) -> Estimate:
        return Estimate(at.posed, finished(at.problem, at.fit, starts, progress, wide))


def _fitted_all(
    base: Estimate,
    made: Matrices,
    points: Sequence[Point],
    progress: Progress,
    rival: float = np.inf,
    patience: int = 0,
) -> Extension:
    """Fit sets, `patience` at a time as long as one of them is better than all before."""
    problem, each = base.problem, patience or max(len(points), 1)
    least, gain = base.fit.lost(problem.train), dispersion(base.fit)
    fits: dict[int, Fit] = {}
    for first in range(0, len(points), each):
        found = trials.spread_until(
            problem.until,
            partial(_fitted, problem, base.fit, rival),
            points[first : first + each],
            lambda p: progress(listed([c.label for c in p[0].candidates]), 1, FIT),
        )
        fits |= {first + i: f for i, f in found.items()}
        now = min((f.lost(problem.train) for f in found.values()), default=np.inf)
        if now > least - problem.gates.equal_nats * gain:
            break
        least = now
    # of copies of another process
    own = [replace(f, hypothesis=points[i][0]) for i, f in fits.items()]
    late = (p for i, p in enumerate(points) if i not in fits and problem.late())
    larger = tuple(base._replace(fit=f) for f in own)
    untried = tuple(p[0].candidates for p in late)
    return Extension(base, larger, made.scans, made.threshold, untried)


def _fitted(problem: Problem, near: Fit, rival: float, point: Point) -> Fit:
    hypothesis, theta = point
    return fit(problem, hypothesis, theta, near.start, by_start=near.by_start, rival=rival)
