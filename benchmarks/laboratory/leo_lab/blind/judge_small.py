# SPDX-License-Identifier: Apache-2.0
"""Judge answers about worlds that are wrong in many small ways, and about pushed robots."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import permutations

from leo_diffmodel.add.patch import found_rows
from leo_diffmodel.explain.problem.classes import Facts
from leo_lab.blind.things import same, Thing, thing
from leo_sim.description.robot import Robot
from leo_sim.effects import EFFECTS

SAYS = ('named', 'partly')
"""Verdicts that are sure of the effects they list."""
LISTS = (*SAYS, 'ambiguous')
PARTS = {'asymmetric_friction': ('coulomb_friction', 'bias_torque')}
"""Laws that are the sum of these, exactly: each of them is there."""
DIFFERENCED = ('velocity_lag',)
"""What differenced rates are, which come half a period late."""


def judge_small(truth: dict, answer: dict, facts: Facts) -> dict:
    """Fields of a case with small differences.

    largest_first: the largest hidden effect is the first of the list; None where none is hidden.
    both: each of two hidden has a row of its own; None where it is not two.
    sure_wrong: an effect of a sure verdict is nothing that is there, large or small.
    extra: how many of the listed effects are nothing that is there.
    small_named_large: nothing large is hidden, and a sure effect is larger than every small one;
        None where something is hidden. A row holds its size in noise floors as `floors`.
    right: the largest comes first, where there is one, and no sure one is wrong.
    """
    verdict, hidden = answer['verdict'], truth['effects']
    rows = found_rows(answer) if verdict in LISTS else []
    strangers = [r for r in rows if not _there(facts, r, _things(truth, facts.robot))]
    sure = answer['effects']
    sure_wrong = verdict in SAYS and any(r in sure for r in strangers)
    first = _largest_first(facts, hidden, rows) if hidden else None
    return {
        'right': first is not False and not sure_wrong,
        'largest_first': first,
        'both': _each(facts, hidden, rows) if len(hidden) == 2 else None,
        'sure_wrong': sure_wrong,
        'extra': len(strangers),
        'small_named_large': None
        if hidden
        else verdict in SAYS and _exceeds(truth, answer['effects']),
        'floors': [row.get('floors') for row in found_rows(answer)],
    }


def judge_pushed(truth: dict, answer: dict, facts: Facts) -> dict:
    """Right: unknown, or exactly what is hidden; sure_wrong: a sure effect that is not."""
    verdict, hidden = answer['verdict'], truth['effects']
    rows = found_rows(answer) if verdict in LISTS else []
    things = [t for e in hidden for t in _covers(thing(e), facts.robot)]
    exact = all(_there(facts, row, things) for row in rows) and _each(facts, hidden, rows)
    told = verdict in SAYS if rows else verdict == 'fine'
    wrong = verdict in SAYS and not all(_there(facts, row, things) for row in answer['effects'])
    return {'right': verdict == 'unknown' or (told and exact), 'sure_wrong': wrong}


def _largest_first(facts: Facts, hidden: Sequence[dict], rows: Sequence[dict]) -> bool:
    largest = max(hidden, key=lambda effect: effect['size'])
    first = rows[:1] and _there(facts, rows[0], _covers(thing(largest), facts.robot))
    return bool(first) and _each(facts, [largest], rows)


def _each(facts: Facts, hidden: Sequence[dict], rows: Sequence[dict]) -> bool:
    """Whether each effect has a row of its own, or for 'all' a row at every joint."""
    named = [thing(row) for row in rows]
    orders = permutations([thing(effect) for effect in hidden])
    return any(_served(facts, order, named) for order in orders)


def _served(facts: Facts, hidden: Sequence[Thing], named: Sequence[Thing]) -> bool:
    """Whether the effects take their rows in turn, the first that fits each."""
    for one in hidden:
        whole = [n for n in named if _is(facts, n, one)][:1]
        parts = [n for part in _joints(one, facts.robot) for n in named if _is(facts, n, part)]
        complete = {where for _, where in parts} == set(_places(one, facts.robot))
        used = whole or (parts if complete else [])
        if not used:
            return False
        named = [n for n in named if n not in used]
    return True


def _things(truth: dict, robot: Robot) -> list[Thing]:
    """Everything that is there, large, small and in the measurement."""
    hidden = [thing(effect) for effect in (*truth['effects'], *truth['small'])]
    hidden += [(part, where) for name, where in hidden for part in PARTS.get(name, ())]
    if truth['sensing']['differenced']:
        hidden += [(name, 'all') for name in DIFFERENCED]
    return [t for one in hidden for t in _covers(one, robot)]


def _covers(one: Thing, robot: Robot) -> list[Thing]:
    return [one, *_joints(one, robot)]


def _joints(one: Thing, robot: Robot) -> list[Thing]:
    """An effect shared by all joints at each of them."""
    return [(one[0], joint) for joint in _places(one, robot)] if one[1] == 'all' else []


def _places(one: Thing, robot: Robot) -> tuple[str, ...]:
    return EFFECTS[one[0]].places(robot)


def _there(facts: Facts, row: dict, things: Iterable[Thing]) -> bool:
    return any(_is(facts, thing(row), other) for other in things)


def _is(facts: Facts, a: Thing, b: Thing) -> bool:
    """As `same`; on a robot of one joint 'all' is that joint."""
    lone = facts.robot.joint_names if len(facts.robot.joint_names) == 1 else ()
    one, other = ((name, 'all' if where in lone else where) for name, where in (a, b))
    return one == other or same(facts, a, b)


def _exceeds(truth: dict, rows: Sequence[dict]) -> bool:
    """Whether an effect is larger than every small difference, in noise floors."""
    sizes = [*(e['size'] for e in truth['small']), *truth['sensing']['sizes'].values()]
    return any(row.get('floors') is not None and row['floors'] > max(sizes) for row in rows)
