# SPDX-License-Identifier: Apache-2.0
"""Which effects may stand beside each other, and which are in another one."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_sim.effects import Parameter

Names = frozenset[Candidate]
Alike = Callable[[Candidate, Candidate], bool]
"""Whether two effects are one, or the same thing in the data."""
EVERYWHERE = 'all'


def label(names: Iterable[Candidate]) -> str:
    """A set in words."""
    return ' + '.join(sorted(c.label for c in names)) or 'the model as given'


def compatible(names: Iterable[Candidate], other: Candidate) -> bool:
    """Whether an effect may stand beside others: not what shares a term with one at its place."""
    return not any(_overlap(c, other) and _terms(c) & _terms(other) for c in names)


def _terms(candidate: Candidate) -> set[Parameter]:
    """What scales an effect: a term of its law each."""
    return {p for p in candidate.parameters if p.scales}


def _overlap(a: Candidate, b: Candidate) -> bool:
    """Whether two effects act at one place."""
    return a.where == b.where or (a.effect.hook == b.effect.hook and 'all' in (a.where, b.where))


def widens(candidate: Candidate, other: Candidate) -> bool:
    """Whether an effect is a wider law than another one at the same place: Stribeck's, Coulomb's.

    Which of them it is, is no question of two causes.
    """
    mine, its = set(candidate.parameters), set(other.parameters)
    return candidate.where == other.where and its < mine


def part_of(candidate: Candidate, other: Candidate) -> bool:
    """Whether an effect is in another: a law of one joint in that of all, or in a wider one."""
    there = candidate.where == other.where or other.where == EVERYWHERE
    mine, its = _laws_of(candidate), _laws_of(other)
    return there and candidate.effect.hook == other.effect.hook and (
        candidate.effect.name == other.effect.name or mine < its)  # fmt: skip


def _laws_of(candidate: Candidate) -> set[tuple[str, str]]:
    """Its parameters; their bounds may differ from joint to joint."""
    return {(p.name, p.unit) for p in candidate.parameters}


def holds(names: Iterable[Candidate], candidate: Candidate, alike: Alike) -> bool:
    """Whether a set has an effect, the same thing by another name, or something that contains it.

    Two effects may do what one does for all joints.
    """
    return any(alike(c, candidate) or part_of(candidate, c) for c in names)
