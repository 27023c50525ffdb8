# SPDX-License-Identifier: Apache-2.0
"""What is chosen where folds are left out, and which set disagrees with the choice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from leo_diffmodel.explain.findings.findings import Choices, Counts
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.select.sets import Names, supported, widens
from leo_diffmodel.explain.select.stable import share


def choices(found: Search, facts: Facts) -> Choices:
    """What is chosen where folds are left out of the choice, and how often."""
    chosen, turns = found.chosen.names, found.turns
    others = [c for names in turns for c in names if not any(facts.alike(c, d) for d in chosen)]
    new = [c for c in others if not any(widens(c, d) or widens(d, c) for d in chosen)]
    return Choices(
        share(turns, chosen, facts.alike),
        _sets(found, facts),
        _counted(others, len(turns)),
        _counted(new, len(turns)),
    )


def other(found: Search, facts: Facts) -> str:
    """The set that leaves much less unexplained than the chosen one, and is not surely behind it.

    Two measures then disagree: the chosen one saves more in all, the other in most windows. A
    set that shares effects with the chosen one must be as small, and supported itself. One that
    shares none may have one effect more: what is little for one effect is no reason against two.
    """
    weight, chosen = found.weight, found.chosen
    left = weight.unexplained(chosen) - weight.trifle(chosen)
    near = [
        s
        for s in found.sets
        if _comparable(found, s, facts)
        and weight.unexplained(s) < left
        and not weight.surely_ahead(chosen, s)
    ]
    best = min(near, key=weight.unexplained, default=None)
    return _label(best.names) if best else ''


def _sets(found: Search, facts: Facts) -> tuple[tuple[tuple[str, ...], float], ...]:
    """How often each set is chosen; the chosen one by other names is the chosen one."""
    chosen, count = found.chosen.names, len(found.turns)

    def is_chosen(names: Names) -> bool:
        return len(names) == len(chosen) and all(
            any(facts.alike(d, c) or widens(d, c) for d in names) for c in chosen
        )

    counts = Counter(tuple(sorted(c.label for c in n)) for n in found.turns if not is_chosen(n))
    mine = tuple(c.label for c in found.final.hypothesis.candidates)
    rest = [(labels, n / count) for labels, n in counts.most_common()]
    return (mine, (count - counts.total()) / count), *rest


def _counted(candidates: Iterable[Candidate], turns: int) -> Counts:
    counts = Counter(c.label for c in candidates)
    return tuple((label, n / turns) for label, n in counts.most_common())


def _label(names: Iterable[Candidate]) -> str:
    return ' + '.join(sorted(c.label for c in names))


def _comparable(found: Search, rival: Scored, facts: Facts) -> bool:
    mine, names = found.chosen.names, rival.names
    if not mine or not names or names <= mine or mine <= names:
        return False
    if not any(facts.alike(a, b) for a in names for b in mine):
        return len(names) <= len(mine) + 1
    same = all(any(facts.alike(a, b) for b in mine) for a in names)
    return (
        len(names) <= len(mine)
        and not same
        and supported(found.sets, rival, found.weight, found.threshold)
    )
