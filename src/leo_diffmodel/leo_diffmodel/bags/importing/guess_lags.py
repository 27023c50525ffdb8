# SPDX-License-Identifier: Apache-2.0
"""Which columns are measured and which were commanded, where no name says it.

A joint does what it was told, later: of columns whose names differ in one word, as a0, a1 and b0,
b1, those that follow are measured. The cross correlation of increments says by how much.
"""

from collections import defaultdict
from itertools import combinations
from typing import NamedTuple

import numpy as np

from .guess_columns import DRIVEN_BY, Roles
from .guess_roles import Role, role_of, words_of
from .log_format import Column, Table

LATEST = 50  # samples that a joint is late at most
SPAN = 10  # samples of an increment: what an encoder rounds counts less
PARTS = 4  # of a log, in each of which the same columns must be the later ones
TOGETHER = 0.5  # correlation from which on they move together in a part
OTHER = 0.5  # of its spread, what a joint that follows leaves of a goal: more is another motion
TIED = 0.98  # of the best correlation: one swing later is as good, the least lag counts
Names = tuple[str, ...]


class Goals(NamedTuple):
    """Roles as the motion says them, what is to be told, and columns that may be exchanged."""

    roles: dict[str, Role]
    notes: tuple[str, ...] = ()
    either: Names = ()


def with_goals(roles: Roles, table: Table) -> Goals:
    """Return the roles with positions and what drives them, where names do not say both."""
    known = {(role.quantity, role.is_goal) for role in roles.values() if role.quantity}
    is_said = ('position', False) in known and known & {*DRIVEN_BY}
    pairs = [] if is_said or len(next(iter(table.values()))) < 2 * LATEST else _pairs(roles)
    found = [(_left(*each, table), each) for each in pairs]
    left, best = min(found, default=(np.inf, ((), ())))
    return _told(dict(roles), *best, table) if left < OTHER else Goals(dict(roles))


def _pairs(roles: Roles) -> list[tuple[Names, Names]]:
    """Return columns and others of the same joints, at most one of them said to be a position."""
    found = defaultdict[tuple[int, str, str], list[tuple[str, str]]](list)
    able = {n: words_of(n) for n, role in roles.items() if role.quantity in ('', 'position')}
    for (one, first), (other, second) in combinations(able.items(), 2):
        differ = [
            k for k, words in enumerate(zip(first, second, strict=False)) if len({*words}) > 1
        ]
        is_open = '' in (roles[one].quantity, roles[other].quantity)
        if len(differ) == 1 and len(first) == len(second) and is_open:
            (k,) = differ
            if k < len(first) - 1 or not first[k].isdecimal():
                found[k, first[k], second[k]].append((one, other))
    return [tuple(zip(*pairs, strict=True)) for pairs in found.values()]


def _told(roles: dict[str, Role], first: Names, second: Names, table: Table) -> Goals:
    late = _late(first, second, table)
    one, other = roles[first[0]], roles[second[0]]
    is_goal = one.is_goal or (other.quantity and not other.is_goal)
    if not (is_goal or (late > 0 and not (one.quantity or other.quantity))):
        first, second, one, other, late = second, first, other, one, -late
    if other.quantity and not one.is_goal and late < 0:
        return Goals(roles)  # what follows the measured ones was not asked for
    for goal, measured in zip(first, second, strict=True):
        named = (role.joint for role in (roles[measured], roles[goal]) if role.quantity)
        joint = next(named, _joint(goal, measured))
        roles[goal] = roles[goal]._replace(quantity='position', is_goal=True, joint=joint)
        roles[measured] = roles[measured]._replace(quantity='position', joint=joint)
    goals, followers = _ends(first), _ends(second)
    if late or one.is_goal:
        by = f'{late} samples before' if late > 0 else 'and the names say so'
        return Goals(roles, (f'{followers} do what {goals} do {by}: measured, and commanded',))
    note = f'{followers} and {goals} do the same and neither is later: which was commanded?'
    return Goals(roles, (note,), first if other.quantity else (*first, *second))


def _joint(one: str, other: str) -> str:
    shared = [a for a, b in zip(words_of(one), words_of(other), strict=True) if a == b]
    return role_of(' '.join(shared)).joint or 'joint'


def _ends(names: Names) -> str:
    return names[0] if len(names) == 1 else f'{names[0]} to {names[-1]}'


def _late(first: Names, second: Names, table: Table) -> int:
    """Return by how many samples the second are later; 0 where parts of the log disagree."""
    x, y = (np.array_split(_increments(names, table), PARTS) for names in (first, second))
    lags = [lag for a, b in zip(x, y, strict=True) if (lag := _lag(a, b)) is not None]
    agree = len({*np.sign(lags)}) == 1
    return int(np.median(lags)) if agree else 0


def _increments(names: Names, table: Table) -> Column:
    values = np.column_stack([table[name] for name in names])
    spread = np.nanstd(values, axis=0)
    return np.nan_to_num((values[SPAN:] - values[:-SPAN]) / np.where(spread > 0, spread, np.inf))


def _lag(x: Column, y: Column) -> int | None:
    """Return where the correlation has its top, of equal ones the nearest; None without one."""
    most = min(LATEST, len(x) // 4)
    lags = np.arange(-most, most + 1)
    agree = np.array([_correlation(*_shifted(x, y, lag)) for lag in lags])
    tops = np.flatnonzero((agree >= np.roll(agree, 1)) & (agree >= np.roll(agree, -1)))
    best = [lags[k] for k in tops if agree[k] >= max(TOGETHER, TIED * agree.max())]
    return min(best, key=abs, default=None)


def _shifted(x: Column, y: Column, lag: int) -> tuple[Column, Column]:
    return x[max(-lag, 0) : len(x) - max(lag, 0)], y[max(lag, 0) : len(y) - max(-lag, 0)]


def _correlation(x: Column, y: Column) -> float:
    size = np.sqrt((x**2).sum() * (y**2).sum())
    return float((x * y).sum() / size) if size > 0 else 0.0


def _left(first: Names, second: Names, table: Table) -> float:
    """Return what the second leave of the first, shifted, as a share of the spread: a median."""
    late = _late(first, second, table)
    each = [_shifted(table[a], table[b], late) for a, b in zip(first, second, strict=True)]
    spread = [max(np.nanstd(x), np.nanstd(y)) for x, y in each]
    left = [np.nanstd(x - y) / s for (x, y), s in zip(each, spread, strict=True) if s > 0]
    return float(np.median(left)) if left else np.inf
