# SPDX-License-Identifier: Apache-2.0
"""Is something missing that no known effect is? Two ways to see it.

What the named effects leave may follow one variable; or one law may explain by itself, and
better, what takes several known effects to imitate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.estimate import helper
from leo_diffmodel.explain.estimate.contact import converged
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.loss import dispersion, gain, most_nats, rest_of, unexplained
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.select.evidence import score
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.settings import Gates
from leo_diffmodel.explain.unknown.attempt import Attempt, attempt, with_fit
from leo_diffmodel.explain.unknown.curves import Curve, curves
from leo_diffmodel.explain.unknown.influence import Influence, influence
from leo_diffmodel.explain.unknown.paths import paths

Array = np.ndarray


@dataclass(frozen=True)
class Found:
    """A law that is no known effect.

    Attributes:
        attempt: the law and its joint fit with the named effects that stay.
        beside: those named effects fitted without the law.
        left: what it was found in.
        blocks: time block of each window, shape (W,).
    """

    attempt: Attempt
    beside: Fit
    left: Influence
    blocks: Array


def find(recordings: Sequence[Recording], found: Search) -> Found | None:
    """The law that what is known cannot stand for, if any.

    On the ground contacts that settle otherwise always leave something that some curve follows:
    there it takes a rest that matters.

    Args:
        recordings: what the search was made in, held-out ones last.
        found: the search; its final hypothesis is what is known.
    """
    problem = found.problem
    blocks = found.posed.blocks.index(problem.windows)
    alone = find_alone(recordings, found)
    if problem.linearisation and not rest_of(problem, found.null, found.final).matters:
        return alone
    return alone or _beyond(recordings, problem, found, blocks)


def _beyond(
    recordings: Sequence[Recording], problem: Problem, found: Search, blocks: Array
) -> Found | None:
    """A law for what the named effects leave."""
    left, best = _curves(recordings, problem, found.final, blocks)
    named = gain(found.null, found.final, problem.train)
    gates = found.weight.gates
    if not _counts(best[0], named, 1.0, gates):
        return None
    tried = _settled(found.posed, attempt(recordings, found.final, left, blocks, best[0]))
    spread = min(tried.dispersion, dispersion(found.final))
    if tried.law.known(gates.law_periods):  # and the search did not want it
        return None
    if not (_counts(best[0], named, spread, gates) and _holds(problem, tried, gates)):
        return None
    kept, tried = _needed(problem, tried, gates)
    beside = found.final
    for index in sorted(set(range(len(beside.hypothesis.candidates))) - set(kept), reverse=True):
        beside = _without(problem, beside, index)
    return Found(tried, beside, left, blocks)


def beside(found: Search, law: Found) -> Search:
    """The search with the named effects that stay beside a law, fitted without it."""
    names = frozenset(law.beside.hypothesis.candidates)
    chosen = found.known(names) or score(Estimate(found.posed, law.beside))
    return replace(found, final=law.beside, chosen=chosen)


def find_alone(recordings: Sequence[Recording], found: Search) -> Found | None:
    """The law that explains more by itself than all effects found so far, if any.

    On the ground this is expensive: there it is tried only where some curve follows what they
    leave, or several of them are at one place.

    Args:
        recordings: what the search is made in, held-out ones last.
        found: the search as it stands.
    """
    problem = found.problem
    blocks = found.posed.blocks.index(problem.windows)
    places = [c.where for c in found.final.hypothesis.candidates]
    if not places:
        return None
    apart = len(set(places)) == len(places)
    if problem.linearisation and apart and _is_whole(recordings, found, blocks):
        return None
    left, best = _curves(recordings, problem, found.null, blocks)
    alone = partial(attempt, recordings, found.null, left, blocks)
    gates = found.weight.gates
    for tried in helper.spread(alone, _distinct(best)[: problem.numerics.laws_tried]):
        tried = _settled(found.posed, tried)
        if tried.law.known(gates.law_periods) or not tried.fit:
            continue
        if unexplained(tried.fit) < gates.law_whole and _beats(tried, found):
            return Found(tried, found.null, left, blocks)
    return None


def _is_whole(recordings: Sequence[Recording], found: Search, blocks: Array) -> bool:
    """Whether no curve follows what the named effects leave."""
    best = _curves(recordings, found.problem, found.final, blocks)[1][0]
    return best.gain < found.weight.gates.law_nats


def _beats(tried: Attempt, found: Search) -> bool:
    """Whether a law explains more than every set of named effects, for what it takes to write."""
    law, problem, gates = tried.fit, found.problem, found.weight.gates
    assert law
    spread = min(tried.dispersion, dispersion(found.final))
    most = most_nats(problem, spread)
    price = _price(problem, len(tried.law.values)) + gates.law_form + gates.margin_nats

    def ahead(named: Fit) -> float:
        saved = gain(named, law, np.ones(problem.windows.count, dtype=bool), most)
        return saved / spread + _price(problem, len(named.theta) - len(found.null.theta)) - price

    return all(ahead(named) > 0 for named in (found.final, *(s.fit for s in found.sets)))


def _settled(posed: Posed, tried: Attempt) -> Attempt:
    """On the ground, a law that explains a good part when linearised by itself."""
    if not posed.problem.linearisation or tried.law.curve.variable.name == 'path':
        return tried
    if tried.fit is None or unexplained(tried.fit) > posed.problem.numerics.law_nearly:
        return tried
    return with_fit(tried, converged(posed, tried.fit).fit, posed.problem)


def _curves(
    recordings: Sequence[Recording], problem: Problem, base: Fit, blocks: Array
) -> tuple[Influence, list[Curve]]:
    left = influence(problem, base)
    return left, curves(left, blocks, paths(recordings, left))


def _counts(curve: Curve, named: float, spread: float, gates: Gates) -> bool:
    """Whether a curve is more than noise, and matters."""
    trained = float(curve.score.gain_train)
    matters = trained > gates.law_share * (trained + named)
    return curve.gain / spread > gates.law_nats and matters


def _holds(problem: Problem, tried: Attempt, gates: Gates) -> bool:
    """Whether the law explains data that nothing was fitted to, where it would show there."""
    if tried.fit is None:
        return tried.gain_held_out > gates.law_agreement * float(tried.law.curve.score.expected)
    moved = ((tried.base.residual - tried.fit.residual) ** 2).sum(axis=-1)
    validated, trained = float(moved[problem.judged].sum()), float(moved[problem.train].sum())
    expected = tried.gain_train * validated / max(trained, 1e-12)
    if expected < gates.law_tells:
        return tried.gain_held_out > -gates.law_tells
    return tried.gain_held_out > gates.law_agreement * expected


def _distinct(best: Sequence[Curve]) -> list[Curve]:
    """The best curve of each variable and carrier."""
    first: dict[tuple, Curve] = {}
    for c in best:
        first.setdefault((c.joint, c.variable.name, c.carrier, bool(c.hertz)), c)
    return list(first.values())


def _needed(
    problem: Problem, tried: Attempt, gates: Gates
) -> tuple[tuple[int, ...], Attempt]:
    """Which effects of the base still earn their place beside the law, and the fit with them."""
    everything = np.ones(problem.windows.count, dtype=bool)
    kept, full = list(range(len(tried.base.hypothesis.candidates))), tried.fit
    while kept and full is not None:
        smaller = [_without(problem, full, i) for i in range(len(kept))]
        costs = [gain(s, full, everything) / dispersion(full) for s in smaller]
        least = int(np.argmin(costs))
        if costs[least] > gates.law_nats:
            break
        full = smaller[least]
        del kept[least]
    return tuple(kept), tried if full is None else with_fit(tried, full)


def _without(problem: Problem, full: Fit, index: int) -> Fit:
    hypothesis, first = full.hypothesis, full.hypothesis.offset(index)
    count = len(hypothesis.candidates[index].parameters)
    theta = np.delete(full.theta, np.arange(first, first + count))
    return fit(problem, hypothesis.without(index), theta, full.start)


def _price(problem: Problem, count: int) -> float:
    """Nats that parameters must earn (Bayesian information criterion)."""
    samples = problem.windows.count * problem.windows.measured[0].size
    return 0.5 * count * float(np.log(samples))
