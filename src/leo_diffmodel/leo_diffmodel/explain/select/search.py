# SPDX-License-Identifier: Apache-2.0
"""From a posed problem to the set of effects that is chosen, and how sure the choice is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from operator import eq
import time

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate import estimator as estimating
from leo_diffmodel.explain.estimate.contact import Contact
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit, unexplained
from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.estimate.smooth import Smooth
from leo_diffmodel.explain.problem.candidates import limited, seen, uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import Posed, refined
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.select import stable
from leo_diffmodel.explain.select.evidence import Scored, Weight
from leo_diffmodel.explain.select.neighbours import judged, searched
from leo_diffmodel.explain.select.sets import Names, Sets
from leo_diffmodel.explain.select.stable import Alike
from leo_msgs_py.console import Reporter
from leo_sim.effects import Effect
from leo_sim.model import Model


@dataclass(frozen=True)
class Search:
    null: Fit  # the model as given, constants refitted, in units of the measurement noise
    final: Fit  # the chosen hypothesis, in the same units
    posed: Posed  # the problem in these units
    chosen: Scored  # the chosen hypothesis as it was compared with the others
    sets: tuple[Scored, ...]  # all hypotheses that were fitted, best first
    scans: tuple[Scan, ...]  # of each candidate on the model as given, the most promising first
    threshold: float  # gain that noise alone can give an effect [nats]
    weight: Weight  # what a nat counts
    resamples: tuple[Names, ...]  # what is chosen where folds are left out, for each draw
    untried: tuple[str, ...] = ()  # what there was no time for, in words
    # what is left of a set when folds have judged its effects
    judge: Callable[[estimating.Estimate], Scored] | None = field(default=None, repr=False)
    # the sets near a fitted one, of the pool or of what it holds
    near: Callable[[estimating.Estimate], estimating.Extension] | None = field(
        default=None, repr=False
    )
    # of a set, as the chosen one has had it
    last_fit: Callable[[Scored], estimating.Estimate] | None = field(default=None, repr=False)

    @property
    def complete(self) -> bool:
        """False where the time was over before the search was."""
        return not self.untried

    @property
    def problem(self) -> Problem:
        return self.posed.problem

    @property
    def leaves_noise(self) -> bool:
        """Whether the final hypothesis leaves no more than noise in nearly all windows."""
        gates = self.problem.gates
        return unexplained(self.final, gates.nearly_all) <= gates.unexplained

    def better_with(self, base: Model) -> float:
        """What the final hypothesis fits better with another base model [nats]."""
        problem, fitted = self.problem, self.final
        other = replace(problem, base=base, rough_step=None, typical=fitted.typical)
        again = fit(other, fitted.hypothesis, fitted.theta, fitted.start)
        return fitted.lost(problem.train) - again.lost(problem.train)

    def known(self, names: Names) -> Scored | None:
        """A hypothesis by its effects, if it was fitted."""
        return next((s for s in self.sets if s.names == names), None)

    def choosing(self, other: Scored) -> 'Search':
        """The search with another set chosen; itself where folds do not ask for all of that."""
        assert self.judge and self.last_fit
        if self.judge(other.at).names != other.names:
            return self
        at = self.last_fit(other)
        return replace(self, chosen=other, final=at.fit, posed=at.posed)


def search(
    recordings: Recordings,
    model: Model,
    posed: Posed,
    extra: Sequence[Effect] = (),
    progress: estimating.Progress = lambda *_: None,
    until: float = np.inf,
    alike: Alike = eq,
    near: Fit | None = None,
    hear: estimating.Hear = lambda *_: None,
) -> Search:
    """Choose the effects that the recordings, held-out ones last, support.

    Uncertain constants of the model are refitted in every hypothesis. `extra` are a user's own
    effects, `near` is what was chosen with a longer integration step. The last fit is over at
    `until`, with the best so far [s of `time.monotonic`]; every better one is heard.
    """
    began, settings = time.monotonic(), posed.problem.settings
    longest = settings.numerics.last_longest
    posed = posed.before(longest * began + (1 - longest) * until)
    kind = Contact if model.robot.contacts else Smooth
    progress('the model as given', 0)
    fits = kind(posed, scales_of(model, posed.problem.windows))
    pool = [limited(c, model, settings.grids) for c in seen(model, recordings, extra)]
    constants = uncertain(model, posed.problem.trained)
    first = fits.first(Hypothesis(constants=constants))
    enough = until - settings.numerics.last_times * (time.monotonic() - began)
    first = first._replace(posed=first.posed.before(max(enough, posed.problem.until)))
    found = Sets(fits, pool, settings, Reporter.of(progress), hear, first.problem.until)
    best = searched(found, first, recordings, near)
    late = found.late
    best = stable.canonical(found, best if late else stable.long_horizon_tie_break(found, best))
    resamples = tuple(s.names for s in stable.resamples(found))
    best = best if late else stable.narrowed(found, best, resamples, alike)
    found.progress('the last fit', 0)
    found.progress.expect(
        {**estimating.steps_ahead(settings.numerics, 0, rounds=0), estimating.SCAN: len(pool)}
    )
    last_fit = partial(_last_fit, found, until, model.integration_step)
    final = last_fit(best)
    found.hear(found.known[frozenset()].at, final)
    return Search(
        null=found.known[frozenset()].fit,
        final=final.fit,
        posed=final.posed,
        chosen=best,
        sets=tuple(found.ordered()),
        scans=found.scans,
        threshold=found.threshold,
        weight=found.weight,
        resamples=resamples,
        untried=(*found.untried, *(['longer windows'] if late else [])),
        judge=partial(judged, found),
        near=lambda at: fits.near(at, pool, found.progress),
        last_fit=last_fit,
    )


def _last_fit(sets: Sets, until: float, step: float, best: Scored) -> estimating.Estimate:
    """A set fitted with the integration step that it needs, that of the robot, s, at least.

    Shorter ones are taken where they fit better: a simulated robot has its own.
    """
    fits = sets.estimator
    posed = refined(best.at.posed.before(until), best.fit.point, step)
    starts, widened = _starts(best.fit, sets.scans), fits.doubt(best.at, sets.pool, sets.progress)
    at = fits.finished(best.at._replace(posed=posed), starts, sets.progress, widened)
    shorter = refined(at.posed, at.fit.point, at.problem.numerics.last_step * step)
    if shorter is not at.posed:
        other = fits.finished(at._replace(posed=shorter), (), sets.progress, widened)
        at = min(at, other, key=lambda a: a.fit.lost(a.problem.train))
    return _largest_first(fits, at)


def _starts(fitted: Fit, scans: Sequence[Scan]) -> list[Array]:
    """Other values that a fit may begin with: those scanned on the model as given, and neutral.

    Whole numbers, which no fit moves, stay those of the fit.
    """
    hypothesis, kept = fitted.hypothesis, fitted.hypothesis.whole
    best = {s.candidate: s.own for s in scans}
    scanned: list[Array] = [best.get(c, np.zeros(0)) for c in hypothesis.candidates]
    constants = np.array([c.value for c in hypothesis.constants])
    starts = [np.concatenate([*scanned, constants]), hypothesis.neutral]
    return [np.where(kept, fitted.theta, t) for t in starts if len(t) == len(kept)]


def _largest_first(fits: estimating.Estimator, at: estimating.Estimate) -> estimating.Estimate:
    """The hypothesis with its effects in order of what each does to the prediction far ahead."""
    full, whole = at.fit.hypothesis, fits.ends(at)
    parts = [full.without(i) for i in range(len(full.candidates))]
    less = [replace(at.fit, hypothesis=p, theta=p.carried(full, at.fit.theta)) for p in parts]
    sizes = [float(((whole - fits.ends(at._replace(fit=fit))) ** 2).mean()) for fit in less]
    return at._replace(fit=at.fit.reordered(np.argsort(sizes)[::-1].tolist()))
