# SPDX-License-Identifier: Apache-2.0
"""Friction laws fitted one above the other, and which of them the data ask for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from leo_diffmodel.datasheet.settings import FRICTION, Rung, RUNGS
from leo_diffmodel.explain.estimate import trials
from leo_diffmodel.explain.estimate.estimator import Estimate, Progress
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.smooth import Smooth
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.select.evidence import score, Scored, weigh, Weight
from leo_diffmodel.explain.select.sets import holds


@dataclass(frozen=True)
class Ladder:
    rungs: tuple[tuple[Rung, Scored], ...]
    """Those that the robot can have, with what each leaves; from the lowest on."""
    weight: Weight  # what a nat counts
    limit: float  # gain that noise alone can give an effect [nats]

    @property
    def chosen(self) -> tuple[Rung, Scored]:
        """The best of the laws that predict better than every one with fewer parameters."""
        fits = [scored for _, scored in self.rungs]
        best = next(s for s in self.weight.ordered(fits) if self._is_needed(s))
        return next(row for row in self.rungs if row[1] is best)

    @property
    def rivals(self) -> list[Rung]:
        return [r for r, s in self.rungs if self.verdict(s) in ('as good', 'perhaps better')]

    @property
    def without(self) -> Fit:
        return _bare(self.chosen[1].fit)

    def verdict(self, scored: Scored) -> str:
        _, best = self.chosen
        if scored is best:
            return 'chosen'
        if self.weight.ahead(scored, best) > 0:
            return 'perhaps better'
        if holds(scored, best):
            return 'no better'
        return 'worse' if self.weight.surely_ahead(best, scored) else 'as good'

    def alone(
        self, fits: Smooth, pool: Sequence[Candidate], progress: Progress
    ) -> list[tuple[Scored, bool]]:
        _, best = self.chosen
        found = fits.with_each(best.at, pool, progress)
        limit = max(self.limit, found.threshold)
        last = {s.fit.hypothesis.candidates[-1]: s for s in map(score, reversed(found.larger))}
        return [(s, self.weight.supports(best, s, limit)) for s in last.values()]

    def _is_needed(self, scored: Scored) -> bool:
        lower = (s for _, s in self.rungs if s.size < scored.size)
        return all(self.weight.supports(s, scored, self.limit) for s in lower)


def climb(fits: Smooth, rich: Estimate, pool: Mapping[str, Candidate], report: Progress) -> Ladder:
    """Fit each law with the other effects of `rich`; the chosen one and its rivals to the end."""
    bare = _bare(rich.fit)
    at = {RUNGS[0].name: fits.refitted(rich, bare.hypothesis, bare.theta)}
    while level := [r for r in RUNGS if r.on in at and r.name not in at and r.effect in pool]:
        points = [(at[r.on], pool[r.effect]) for r in level]
        work = partial(_above, fits, rich.fit)
        found = trials.spread(work, points, lambda p: report(p[1].label))
        for rung, (below, candidate), fitted in zip(level, points, found, strict=True):
            own = below.fit.hypothesis.with_candidate(candidate)  # not another process' copy
            at[rung.name] = below._replace(fit=replace(fitted, hypothesis=own))
    while True:
        ladder = _compared(fits, at)
        leading = [ladder.chosen[0].name, *(r.name for r in ladder.rivals)]
        rough = next((name for name in leading if at[name].fit.certificate is None), None)
        if rough is None:
            return ladder
        at[rough] = fits.finished(at[rough], [at[rough].fit.hypothesis.neutral], report)
        report(f'friction: {rough}')


def _compared(fits: Smooth, at: Mapping[str, Estimate]) -> Ladder:
    rungs = tuple((r, score(at[r.name])) for r in RUNGS if r.name in at)
    weight = weigh([scored for _, scored in rungs], fits.most_nats)
    return Ladder(rungs, weight, at[RUNGS[0].name].problem.gates.least_nats)


def _bare(fitted: Fit) -> Fit:
    full = fitted.hypothesis
    rest = tuple(c for c in full.candidates if c.effect.name not in FRICTION)
    part = replace(full, candidates=rest)
    return replace(fitted, hypothesis=part, theta=part.carried(full, fitted.theta))


def _above(fits: Smooth, rich: Fit, point: tuple[Estimate, Candidate]) -> Fit:
    """A law and one effect more: from where a scan points, and from the values of `rich`."""
    below, candidate = point
    begun, problem = added(fits, below, candidate, lambda *_: None).fit, below.problem
    begins = (begun.theta, below.fit.start), (_values(begun, rich), rich.start)
    ends = [fit(problem, begun.hypothesis, *b, thorough=True) for b in begins]
    return min(ends, key=lambda f: float(f.loss[problem.train].sum()))


def _values(begun: Fit, rich: Fit) -> np.ndarray:
    known, whole = rich.hypothesis, begun.hypothesis
    values = {
        p: rich.theta[known.offset(i) + k]
        for i, c in enumerate(known.candidates)
        for k, p in enumerate(c.parameters)
    }
    own = [p for c in whole.candidates for p in c.parameters]
    found = [values.get(p, value) for p, value in zip(own, begun.theta, strict=False)]
    return np.concatenate([found, rich.theta[known.first_constant :]])


def added(fits: Smooth, at: Estimate, candidate: Candidate, progress: Progress) -> Estimate:
    found = fits.with_each(at, [candidate], progress).larger
    return min(found, key=lambda e: float(e.fit.loss[e.problem.train].sum()))


def better(
    fits: Smooth, at: Estimate, pool: Sequence[Candidate], progress: Progress
) -> Estimate | None:
    """The best of the effects that surely predict better what no fit saw; None where none does."""
    found, before = fits.with_each(at, pool, progress), score(at)
    larger = [score(e) for e in found.larger]
    weight = weigh([before, *larger], fits.most_nats)
    gates = at.problem.gates
    limit = max(gates.least_nats, found.threshold)
    able = [s for s in larger if weight.supports(before, s, limit)]
    best = next(iter(weight.ordered(able)), None) if able else None
    # of those that do as well the first of the catalogue
    return next((s.at for s in able if best and weight.ahead(best, s) <= gates.equal_nats), None)
