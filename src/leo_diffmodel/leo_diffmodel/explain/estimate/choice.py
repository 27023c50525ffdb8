# SPDX-License-Identifier: Apache-2.0
"""Choose effects on matrices: forward, back, and the sets near one, by linear algebra alone."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
import itertools
from operator import itemgetter

import numpy as np

from leo_diffmodel.explain.estimate.fitted import dispersion, Fit
from leo_diffmodel.explain.estimate.matrices import Matrices
from leo_diffmodel.explain.estimate.terms import Term
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Candidate, compatible, widens
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import Numerics, Settings

INERTIA = 'inertia'
Kept = Callable[[Candidate], bool]


@dataclass(frozen=True)
class Price:
    """What an effect and each of its parameters must save [nats]."""

    effect: float
    parameter: float

    def of(self, terms: Iterable[Term]) -> float:
        return sum(self.effect + self.parameter * len(t.columns) for t in terms)


def price_of(problem: Problem, fitted: Fit, made: Matrices) -> Price:
    """What an effect must save, where residuals are as much alike in time as here."""
    spread = dispersion(fitted)
    samples = max(float(likelihood.degrees(fitted.residual, 0).sum()) / spread, 2.0)
    parameter = problem.gates.price * float(np.log(samples))
    return Price(made.threshold * spread, parameter * spread)


def choose(
    matrices: Matrices, price: Price, numerics: Numerics, kept: Kept = lambda _: False
) -> list[Term]:
    """The terms that save most less their price; what is `kept` stays, or a wider law of it.

    All is linear near the fit only: what saves but a small share of the best waits for the next.
    """
    held = pruned(matrices, list(matrices.members), price, kept)
    least = 0.0
    looked = numerics.bounded_looks
    while len(held) < numerics.most_terms and (
        found := _best(matrices, held, price, least, looked, kept)
    ):
        worth, more = found[0]
        larger = _with(matrices, held, more, price, kept)
        if _needed(matrices, larger, price, kept) >= _needed(matrices, held, price, kept):
            break
        held, least = larger, max(least, numerics.wait * worth)
    return held


def first_steps(
    matrices: Matrices, price: Price, numerics: Numerics, kept: Kept = lambda _: False
) -> list[list[Term]]:
    """Sets with one thing more than a fit that is far off, those that save most first."""
    held = pruned(matrices, list(matrices.members), price, kept)
    found = _best(matrices, held, price, 0.0, numerics.bounded_looks, kept)
    steps = (_with(matrices, held, more, price, kept) for _, more in found)
    one_each = {frozenset(t.candidate for t in terms): terms for terms in steps}
    return [*one_each.values()][: numerics.patience] or [held]


def _with(
    matrices: Matrices, held: list[Term], more: list[Term], price: Price, kept: Kept
) -> list[Term]:
    """Some terms and more, less those of them that are not worth their price beside these."""
    added = {t.candidate for t in more}
    return pruned(matrices, _joined(held, more), price, lambda c: kept(c) or c in added)


def _cost(matrices: Matrices, terms: Sequence[Term], price: Price) -> float:
    return matrices.least(terms)[0] + price.of(terms)


def _best(
    matrices: Matrices, held: list[Term], price: Price, least: float, looked: int, usual: Kept
) -> list[tuple[float, list[Term]]]:
    """What saves most when added, with how much; none that is not worth its price."""
    groups = [*_groups(matrices, held)]
    if not groups:
        return []
    gains = np.array(matrices.gains(held, groups)) - [price.of(g) for g in groups]
    now = _needed(matrices, held, price, usual)
    looks = [int(i) for i in np.argsort(-gains)[:looked] if gains[i] > least]
    sets = [_joined(held, groups[i]) for i in looks]
    worth = [now - _needed(matrices, terms, price, usual) for terms in sets]
    found = [(w, groups[i]) for w, i in zip(worth, looks, strict=True) if w > max(least, 0.0)]
    return sorted(found, key=itemgetter(0), reverse=True)


def _needed(matrices: Matrices, terms: list[Term], price: Price, usual: Kept) -> float:
    """What a set costs; without the usual losses where it makes most of them needless.

    One cause, as a weak supply, may do at all joints what losses at each of them do.
    """
    least = pruned(matrices, terms, price, lambda c: not usual(c))
    before, after = (sum(usual(t.candidate) for t in some) for some in (terms, least))
    return _cost(matrices, least if 2 * after < before else terms, price)


def rivals(matrices: Matrices, price: Price, settings: Settings, near: float) -> list[list[Term]]:
    """Sets near a fit that cost least: one effect more, or one or two in the place of another.

    Of few effects (`many`) also with one in the place of two; of none or one, pairs. What costs
    `near` nats more than the fit is no rival, nor is what is more and not worth its price; a share
    of what leaving out an effect costs is allowed, as linear answers so far away bend.
    """
    held, numerics = [*matrices.members], settings.numerics
    now, few = _cost(matrices, held, price), len(held) <= settings.gates.many
    outs = [out for n in range(1, 2 + few) for out in itertools.combinations(held, n)]
    alone = _with_one(matrices, held, price)
    found = [f for f in alone if f[0] < now]
    most = now + near if held else now
    pairs = _pairs(matrices, alone, most, price, numerics) if not held else []
    for rest in ([t for t in held if t not in out] for out in outs):
        others = _with_one(matrices, rest, price)
        bent = settings.gates.share * (_cost(matrices, rest, price) - now)
        found += [f for f in others if f[0] < now + max(near, bent)]
        if len(rest) == len(held) - 1:
            pairs += _pairs(matrices, others, most, price, numerics)
    return _least([f for f in (*found, *pairs) if _is_other(held, f[1])], numerics)


def _pairs(
    matrices: Matrices,
    alone: list[tuple[float, list[Term]]],
    most: float,
    price: Price,
    numerics: Numerics,
) -> list[tuple[float, list[Term]]]:
    """What the best sets with one effect become with another one, that does another thing."""
    leaders = sorted(alone, key=itemgetter(0))[: numerics.leaders]
    return [
        (cost, pair)
        for _, one in leaders
        for cost, pair in _with_one(matrices, one, price)
        if cost < most and matrices.alike(pair[:-1], pair[-1]) < numerics.parallel
    ]


def _is_other(held: list[Term], terms: list[Term]) -> bool:
    """Whether the effects are others than those of a fit, or have other whole numbers."""
    same = {t.candidate for t in held} == {t.candidate for t in terms}
    return not same or any(t.candidate.has_whole for t in {*terms} - {*held})


def _with_one(
    matrices: Matrices, held: list[Term], price: Price
) -> list[tuple[float, list[Term]]]:
    """Some terms with each further one, and what that costs, limits aside."""
    names = frozenset(t.candidate for t in held)
    able = [t for t in matrices.terms if _stands(names, t.candidate)]
    if not able:
        return []
    gains = matrices.gains(held, [[t] for t in able])
    now = _cost(matrices, held, price)
    return [
        (now - gain + price.of([t]), _joined(held, [t]))
        for gain, t in zip(gains, able, strict=True)
    ]


def _least(found: list[tuple[float, list[Term]]], numerics: Numerics) -> list[list[Term]]:
    """The sets that cost least, each from a few values of what no fit moves."""
    begins: dict[frozenset[Candidate], dict[tuple, list[Term]]] = {}
    for _, terms in sorted(found, key=itemgetter(0)):
        names = frozenset(t.candidate for t in terms)
        if names not in begins and len(begins) == numerics.singles:
            break
        of_set = begins.setdefault(names, {})
        if len(of_set) < numerics.begins:
            of_set.setdefault(tuple(t.fixed for t in terms), terms)
    return [terms for of_set in begins.values() for terms in of_set.values()]


def _groups(matrices: Matrices, held: Sequence[Term]) -> Iterator[list[Term]]:
    """Each further term alone, and together what changes the inertia of a link.

    A part of a payload alone may look like anything; a payload that is a candidate stands for it.
    """
    names = frozenset(t.candidate for t in held)
    able = [t for t in matrices.terms if _stands(names, t.candidate)]
    yield from ([t] for t in able)
    links: dict[str, dict[Candidate, Term]] = {}
    for t in able:
        if t.candidate.effect.hook == 'body' and t.candidate.effect.family == INERTIA:
            links.setdefault(t.candidate.where, {}).setdefault(t.candidate, t)
    for of_link in links.values():
        parts = {name for c in of_link for name in c.effect.together}
        group = [t for c, t in of_link.items() if c.effect.name not in parts]
        if len(group) > 1:
            yield group


def _stands(names: frozenset[Candidate], candidate: Candidate) -> bool:
    """Whether an effect may stand with others; a wider law does so in the place of a narrower."""
    others = {c for c in names if not widens(candidate, c)}
    return candidate not in names and compatible(others, candidate)


def _joined(held: Sequence[Term], more: Sequence[Term]) -> list[Term]:
    rest = [t for t in held if not any(widens(m.candidate, t.candidate) for m in more)]
    return [*rest, *more]


def pruned(
    matrices: Matrices, held: list[Term], price: Price, kept: Kept = lambda _: False
) -> list[Term]:
    """The terms less those that are not worth their price, the least first."""
    now = _cost(matrices, held, price)
    while able := [t for t in held if not kept(t.candidate)]:
        parts = [[t for t in held if t is not out] for out in able]
        costs = [_cost(matrices, part, price) for part in parts]
        if min(costs) > now:
            break
        now, held = min(costs), parts[int(np.argmin(costs))]
    return held
