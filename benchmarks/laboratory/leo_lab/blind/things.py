# SPDX-License-Identifier: Apache-2.0
"""Effects as (name, place), and when an answer's are those that are hidden."""

from __future__ import annotations

from collections.abc import Iterable

from leo_diffmodel.explain.problem.classes import Facts, why_same
from leo_diffmodel.explain.settings import SETTINGS

LARGEST_SET = 3
Thing = tuple[str, str]


def found(facts: Facts, hidden: dict, row: dict) -> bool:
    """Whether a row names the hidden effect, or leaves it open among few."""
    one, rivals = thing(hidden), left_open(row)
    if len(rivals) == 1 or all(same(facts, thing(row), r) for r in rivals):
        return one in rivals or same(facts, one, thing(row))
    return one in rivals and distinct(facts, rivals) <= LARGEST_SET


def thing(row: dict) -> Thing:
    """Name and place of an effect, hidden or answered."""
    return row['name'], row['where']


def left_open(row: dict) -> set[Thing]:
    """The effects that a row leaves open, itself included."""
    near = [r for r in row['confusable_with'] if r['separable_nats'] < SETTINGS.gates.margin_nats]
    return {thing(row), *map(thing, near)}


def same(facts: Facts, a: Thing, b: Thing) -> bool:
    """Whether two are one in the data."""
    return a == b or why_same(a, b, facts) is not None


def distinct(facts: Facts, things: Iterable[Thing]) -> int:
    """How many different things there are, where those that are the same in the data are one."""
    different: list[Thing] = []
    for one in sorted(things):
        if not any(same(facts, one, other) for other in different):
            different.append(one)
    return len(different)
