# SPDX-License-Identifier: Apache-2.0
"""Which effects may stand together in a hypothesis."""

from __future__ import annotations

from collections.abc import Iterable

from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_sim.effects import Parameter

EVERYWHERE = 'all'


def compatible(names: Iterable[Candidate], other: Candidate) -> bool:
    """Whether an effect may stand with others: not what shares a term with one at its place."""

    def overlaps(one: Candidate) -> bool:
        everywhere = EVERYWHERE in (one.where, other.where)
        return one.where == other.where or (everywhere and one.effect.hook == other.effect.hook)

    return not any(overlaps(c) and _terms(c) & _terms(other) for c in names)


def _terms(candidate: Candidate) -> set[Parameter]:
    return {p for p in candidate.parameters if p.scales}


def widens(candidate: Candidate, other: Candidate) -> bool:
    """Whether an effect is a wider law than another one at the same place: Stribeck's, Coulomb's.

    Which of them it is, is no question of two causes.
    """
    return candidate.where == other.where and set(other.parameters) < set(candidate.parameters)
