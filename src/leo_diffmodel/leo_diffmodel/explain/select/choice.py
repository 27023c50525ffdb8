# SPDX-License-Identifier: Apache-2.0
"""Choose effects on matrices: forward, back and in exchange, each step by linear algebra alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.explain.estimate.matrices import Matrices, Term
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.select.sets import compatible, widens
from leo_diffmodel.explain.settings import Numerics

INERTIA = 'inertia'
Kept = Callable[[Candidate], bool]


@dataclass(frozen=True)
class Price:
    """What an effect and each of its parameters must save [nats]."""

    effect: float
    parameter: float

    def of(self, terms: Iterable[Term]) -> float:
        """The price of some terms."""
        return sum(self.effect + self.parameter * len(t.columns) for t in terms)


def choose(
    matrices: Matrices, price: Price, numerics: Numerics, kept: Kept = lambda _: False
) -> list[Term]:
    """The terms that save most less their price.

    What is linear here is so only near the fit. So effects that save but a small share of what the
    best one saves have to wait for the next fit. What is to be `kept` stays, or a wider law of it.
    """
    held = pruned(matrices, list(matrices.members), price, kept)
    least = 0.0
    while (found := _best(matrices, held, price, least, numerics.bounded_looks)) and len(
        held
    ) < numerics.most_terms:
        worth, more = found
        held = pruned(matrices, _joined(held, more), price, kept)
        least = max(least, numerics.wait * worth)
    return held


def _cost(matrices: Matrices, terms: Sequence[Term], price: Price) -> float:
    return matrices.least(terms)[0] + price.of(terms)


def _best(
    matrices: Matrices, held: Sequence[Term], price: Price, least: float, looked: int
) -> tuple[float, list[Term]] | None:
    """What saves most when added, with how much; None where nothing is worth its price."""
    groups = [*_groups(matrices, held)]
    if not groups:
        return None
    gains = np.array(matrices.gains(held, groups)) - [price.of(g) for g in groups]
    now = _cost(matrices, held, price)
    looks = [int(i) for i in np.argsort(-gains)[:looked] if gains[i] > least]
    worth = [(now - _cost(matrices, _joined(held, groups[i]), price), i) for i in looks]
    best = max(worth, default=(0.0, 0))
    return (best[0], groups[best[1]]) if best[0] > max(least, 0.0) else None


def _groups(matrices: Matrices, held: Sequence[Term]) -> Iterator[list[Term]]:
    """Each further term alone, and what changes the inertia of a link together.

    A payload changes mass, centre of mass and inertia; one of them alone may look like anything.
    """
    names = frozenset(t.candidate for t in held)
    able = [t for t in matrices.terms if _stands(names, t.candidate)]
    yield from ([t] for t in able)
    links: dict[str, dict[Candidate, Term]] = {}
    for t in able:
        if t.candidate.effect.hook == 'body' and t.candidate.effect.family == INERTIA:
            links.setdefault(t.candidate.where, {}).setdefault(t.candidate, t)
    yield from ([*of_link.values()] for of_link in links.values() if len(of_link) > 1)


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
