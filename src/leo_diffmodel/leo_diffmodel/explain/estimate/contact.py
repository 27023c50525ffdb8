# SPDX-License-Identifier: Apache-2.0
"""Estimator for robots with contact: successive halving, each candidate on contacts of its own."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate import estimator, ground_fit, trials
from leo_diffmodel.explain.estimate.fit import fit, settled_as
from leo_diffmodel.explain.estimate.fitted import Certificate, dispersion, Fit, gain
from leo_diffmodel.explain.estimate.ground_fit import converged, Iterate, linearised, most_nats
from leo_diffmodel.explain.estimate.ground_scan import GroundScanner, is_straight, Traces
from leo_diffmodel.explain.estimate.imitation import imitations
from leo_diffmodel.explain.estimate.scan import Scan, threshold
from leo_diffmodel.explain.problem.hypothesis import Candidate, compatible, Hypothesis, widens
from leo_diffmodel.explain.problem.pose import Posed
from leo_msgs_py.console import Reporter
from leo_sim.description.robot import Robot

Field = Sequence[tuple[Scan, Iterate]]
"""Candidates that are still in the race, and how far their fits have come."""


@dataclass
class Contact(estimator.Estimator):
    """Fits windows whose contacts are settled; what scans find out is kept from round to round."""

    _traces: Traces = field(default_factory=dict, init=False)

    def first(self, hypothesis: Hypothesis) -> estimator.Estimate:
        problem = ground_fit.settled_on_ground(self.posed.problem)
        return estimator.Estimate(replace(self.posed, problem=problem), fit(problem, hypothesis))

    def near(
        self,
        base: estimator.Estimate,
        pool: Sequence[Candidate],
        progress: Reporter,
        rival: float = np.inf,
    ) -> estimator.Extension:
        """Scan all candidates; the most promising are fitted further and further beside it."""
        pool = [c for c in pool if compatible(base.names, c)]
        posed, null, _ = converged(base.posed, base.fit)
        scanner = GroundScanner(posed.problem, null, self.scales, self._traces)
        traced = scanner.trace(pool, lambda c: progress(c.label, 1, estimator.SCAN))
        scans = sorted(map(scanner.scan, traced), key=lambda s: -s.gain)
        limit = threshold(scans, posed.problem.settings)
        null, last = successive_halving(posed, null, scans, limit, progress)
        larger = tuple(estimator.Estimate(at.posed, at.fit) for at in last)
        untried = [] if last else [(s.candidate,) for s in scans]
        untried += [(c,) for c in pool if c not in traced]
        return estimator.Extension(
            estimator.Estimate(posed, null), larger, tuple(scans), limit, tuple(untried)
        )

    def finished(
        self,
        at: estimator.Estimate,
        starts: Sequence[Array],
        progress: estimator.Progress,
        wide: estimator.Widened = estimator.as_fitted,
    ) -> estimator.Estimate:
        """From one start only: what another one costs here is most of a search."""
        posed, best = ground_fit.polished(at.posed, at.fit) if at.fit.hypothesis.size else at
        ended = best.decrement < at.problem.numerics.converged_nats * dispersion(best)
        certificate = Certificate(best.decrement, 1, 1, ended)
        return estimator.Estimate(posed, replace(best, certificate=certificate))


def successive_halving(
    posed: Posed, null: Fit, scans: Sequence[Scan], limit: float, progress: estimator.Progress
) -> tuple[Fit, list[Iterate]]:
    """The hypothesis, and those with one effect more that successive halving leaves.

    Each candidate has contacts of its own from the first step on: those without it favour small
    effects. The last are fitted in all windows. None where the time is over.
    """
    if posed.problem.late() or not scans:
        return null, []
    numerics = posed.problem.numerics
    least = numerics.ground_worth * limit
    worth = [s for s in scans[: numerics.contenders] if s.gain > least] or [scans[0]]
    robot = posed.problem.base.robot
    worth += [s for s in scans if _moves_ground(s.candidate, robot) and s not in worth]
    some = posed.problem.some_trained(numerics.ground_windows)
    field, nats = _played(posed.take(some), null.take(some), worth, progress)
    if posed.problem.late():
        return null, []
    first = finalists(null, [replace(s, theta=at.fit.theta) for s, at in field], scans)
    last = _each(linearised, posed, [_with(null, s) for s in first])
    promised = nats * int(posed.problem.train.sum()) / len(some)
    more = numerics.worth_more * limit
    if promised > numerics.worth_all * limit and _gained(null, last) > more:
        last = _each(converged, posed, [at.fit for at in last])
        progress('the last contenders', len(last), estimator.FIT)
        last += _imitating(min(last, key=_loss), scans)
    null = _from_others(null, last)
    return null, [at._replace(fit=_from_others(at.fit, last)) for at in last]


def _moves_ground(candidate: Candidate, robot: Robot) -> bool:
    """Whether it moves the ground against the robot, so that no scan knows its contacts."""
    sensed = candidate.effect.hook == 'sensor' and is_straight(candidate)
    return candidate.effect.hook == 'ground' or (sensed and candidate.where in robot.base_joints)


def _played(
    posed: Posed, null: Fit, scans: Sequence[Scan], progress: estimator.Progress
) -> tuple[Field, float]:
    """The last contenders, best first, and what the best of them gains [nats]."""
    iterates = _each(linearised, posed, [_with(null, s) for s in scans])
    field: Field = list(zip(scans, iterates, strict=True))
    numerics = posed.problem.numerics
    for left, behind in numerics.halving:
        field, rising = _further(null, field, left, behind)
        progress(field[0][0].candidate.label, len(field), 'contender')
    for _ in range(numerics.late_steps):
        if not rising or posed.problem.late():
            break
        field, rising = _further(null, field, *numerics.halving[-1])
    field = field[: numerics.halving[-1][0]]
    return field, _gained(null, [at for _, at in field])


def _further(null: Fit, field: Field, left: int, behind: float) -> tuple[Field, bool]:
    """Those that go on after a step, best first, and whether some do only for what it gained."""
    iterates = trials.spread(ground_fit.advanced, [at for _, at in field])
    after = [(s, _of(at, was.fit)) for (s, was), (at, _) in zip(field, iterates, strict=True)]
    spread = min(dispersion(at.fit) for _, at in after)
    problem = after[0][1].posed.problem
    train, most = problem.train, most_nats(problem, spread)
    saved = np.array(gains(null, [at.fit for _, at in after], train, most))
    order, lag = np.argsort(saved)[::-1], saved.max() - saved
    close = (saved > 0) & (lag < behind * spread)
    near = [i for i in order[:left] if close[i] or i == order[0]]
    was, now = (np.array([_loss(at) for _, at in each]) for each in (field, after))
    rises = was - now > problem.numerics.rising * (now - now.min())
    rising = [i for i in order if i not in near and rises[i]]
    return [after[i] for i in (*near, *rising)], bool(rising)


def gains(null: Fit, others: Sequence[Fit], chosen: Array, most: float) -> list[float]:
    """What each of several fits saves [nats], as `gain`.

    Where a window may say so much only, all may save the most in all windows. They are compared
    with one another then: each saves what the best does, less what it is behind that.
    """
    if not np.isfinite(most):
        return [gain(null, f, chosen) for f in others]
    best = others[0]
    for f in others[1:]:
        best = f if gain(best, f, chosen, most) > 0 else best
    saved = gain(null, best, chosen, most)
    return [saved - gain(f, best, chosen, most) for f in others]


def _gained(null: Fit, iterates: Sequence[Iterate]) -> float:
    fits, problem = [at.fit for at in iterates], iterates[0].posed.problem
    spread = min(map(dispersion, fits))
    return max(gains(null, fits, problem.train, most_nats(problem, spread))) / spread


def _each(
    function: Callable[[Posed, Fit], Iterate], posed: Posed, points: Sequence[Fit]
) -> list[Iterate]:
    iterates = trials.spread(partial(function, posed), points)
    return [_of(at, point) for at, point in zip(iterates, points, strict=True)]


def _of(at: Iterate, point: Fit) -> Iterate:
    """With the candidates of `point` itself, of which another process gives copies."""
    return at._replace(fit=replace(at.fit, hypothesis=point.hypothesis))


def _from_others(fitted: Fit, last: Sequence[Iterate]) -> Fit:
    for at in last:
        fitted = settled_as(at.posed.problem, fitted, at.fit)
    return fitted


def _imitating(best: Iterate, scans: Sequence[Scan]) -> list[Iterate]:
    near = imitations(best.posed.problem, best.fit, scans)
    rest = best.fit.hypothesis.without(len(best.fit.hypothesis.candidates) - 1)
    points = [_with(replace(best.fit, hypothesis=rest), scan) for scan in near]
    return _each(converged, best.posed, points)


def _loss(at: Iterate) -> float:
    return at.fit.lost(at.posed.problem.train)


def finalists(null: Fit, field: Sequence[Scan], scans: Sequence[Scan]) -> list[Scan]:
    """The last contenders, and the effects that they hold, as Stribeck friction does Coulomb's."""
    there = {s.candidate for s in field}
    other = [s for s in scans if s.candidate not in there]
    return [*field, *(part for s in field for part in _parts(null, s, other))]


def _parts(null: Fit, scan: Scan, scans: Sequence[Scan]) -> list[Scan]:
    candidate, first = scan.candidate, null.hypothesis.first_constant
    names = [p.name for p in candidate.parameters]
    values = dict(zip(names, scan.theta[first:], strict=False))
    rest = scan.theta[first + len(values) :]
    found = []
    for other in scans:
        if widens(candidate, other.candidate):
            own = [values[p.name] for p in other.candidate.parameters]
            theta = np.concatenate([scan.theta[:first], own, rest])
            found.append(replace(other, theta=theta))
    return found


def _with(null: Fit, scan: Scan) -> Fit:
    """The effect of a scan next to the others, at its values; not fitted."""
    hypothesis = null.hypothesis.with_candidate(scan.candidate)
    return replace(null, hypothesis=hypothesis, theta=hypothesis.bounded(scan.theta))
