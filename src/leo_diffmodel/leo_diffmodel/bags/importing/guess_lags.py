# SPDX-License-Identifier: Apache-2.0
"""Which columns are measured and which were commanded, where no name says it.

Of columns that do the same, as a0, a1 and b0, b1, the later ones are measured: joints follow.
"""

from collections import defaultdict
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.signal import correlate

from .guess_columns import DRIVEN_BY, Roles
from .guess_roles import Role, role_of, words_of
from .log_format import Column, Table

LATEST = 50  # samples that a joint is late at most
SPAN = 10  # samples of an increment: what an encoder rounds counts less
PARTS = 4  # of a log, in each of which the same columns must be the later ones
TOGETHER = 0.5  # correlation of increments from which on they move together in a part
OTHER = 0.5  # of its spread, what a joint that follows leaves of a goal: more is another motion
TIED = 0.98  # of the best correlation: as good as it, as one swing later may be
TINY = np.finfo(float).tiny
Names = tuple[str, ...]


class Goals(NamedTuple):
    """Roles as the motion says them, what is to be told, and columns that may be exchanged."""

    roles: dict[str, Role]
    notes: Names = ()
    either: Names = ()


def with_goals(roles: Roles, table: Table) -> Goals:
    """Return the roles with positions and what drives them, where names do not say both."""
    known = {(role.quantity, role.is_goal) for role in roles.values()}
    is_said = ('position', False) in known and known & {*DRIVEN_BY}
    short = len(next(iter(table.values()))) < 2 * LATEST
    pairs = [] if is_said or short else _pairs(roles)
    alike = [pair for pair in pairs if _left(*pair, table) < OTHER]
    return _told(dict(roles), *alike[0], table) if len(alike) == 1 else Goals(dict(roles))


def _pairs(roles: Roles) -> list[tuple[Names, Names]]:
    """Return columns and others whose names differ in one word; one is known, where any is."""
    found = defaultdict[tuple[int, str, str], list[tuple[str, str]]](list)
    able = {n: words_of(n) for n, role in roles.items() if role.quantity in ('', 'position')}
    unknown = 1 if any(roles[name].quantity for name in able) else 2
    for (one, a), (other, b) in combinations(able.items(), 2):
        differ = [k for k, (x, y) in enumerate(zip(a, b, strict=False)) if x != y]
        is_open = [roles[one].quantity, roles[other].quantity].count('') == unknown
        if len(a) == len(b) and len(differ) == 1 and is_open:
            (k,) = differ
            found[k - len(a), a[k], b[k]].append((one, other))
    named = [rows for (at, word, _), rows in found.items() if at < -1 or not word.isdecimal()]
    return [(tuple(a for a, _ in rows), tuple(b for _, b in rows)) for rows in named]


def _told(roles: dict[str, Role], goals: Names, measured: Names, table: Table) -> Goals:
    late, a, b = _late(goals, measured, table), roles[goals[0]], roles[measured[0]]
    is_other_way = b.is_goal or (a.quantity and not a.is_goal)
    if is_other_way or not (a.quantity or b.quantity or late > 0):
        goals, measured, late, a, b = measured, goals, -late, b, a
    if b.quantity and not a.is_goal and late < 0:
        return Goals(roles)  # what follows the measured ones was not asked for
    for goal, other in zip(goals, measured, strict=True):
        shared = ' '.join(word for word in words_of(goal) if word in words_of(other))
        said = (r.joint for r in (roles[other], roles[goal]) if r.quantity)
        joint = next(said, role_of(shared).joint or 'joint')
        roles[goal] = Role('position', True, joint, roles[goal].unit)
        roles[other] = Role('position', False, joint, roles[other].unit)
    one, other = (f'{names[0]} to {names[-1]}' for names in (measured, goals))
    if late or a.is_goal:
        by = f'{late} samples before' if late > 0 else 'and the names say so'
        return Goals(roles, (f'{one} do what {other} do {by}: measured, and commanded',))
    note = f'{one} and {other} do the same and neither is surely later: which was commanded?'
    return Goals(roles, (note,), goals if b.quantity else (*goals, *measured))


def _values(names: Names, table: Table) -> Column:
    return np.nan_to_num(np.column_stack([table[name] for name in names]))


def _late(first: Names, second: Names, table: Table) -> int:
    """Return by how many samples the second are later; 0 where parts of the log disagree."""
    values = [_values(names, table) for names in (first, second)]
    steps = [(v[SPAN:] - v[:-SPAN]) / np.maximum(v.std(axis=0), TINY) for v in values]
    parts = zip(*(np.array_split(each, PARTS) for each in steps), strict=True)
    lags = [lag for x, y in parts if (lag := _lag(x, y)) is not None]
    return int(np.median(lags)) if len({*np.sign(lags)}) == 1 else 0


def _lag(x: Column, y: Column) -> int | None:
    """Return where the correlation has its top; None without one, or where a swing later ties."""
    every = sum(correlate(b, a) for a, b in zip(x.T, y.T, strict=True))
    lags = np.arange(-(len(x) // 2), len(x) // 2 + 1)
    agree = every[lags + len(x) - 1] / max(np.sqrt((x**2).sum() * (y**2).sum()), TINY)
    agree /= 1 - np.abs(lags) / len(x)  # as only so much overlaps
    late = np.abs(lags) <= min(LATEST, len(x) // 4)
    top = agree[late].max()
    tied = np.flatnonzero(agree >= TIED * top)
    if top < TOGETHER or agree[tied[0] : tied[-1] + 1].min() < TOGETHER:
        return None
    return int(lags[late][agree[late].argmax()])


def _left(first: Names, second: Names, table: Table) -> float:
    """Return what the second leave of the first when they are shifted, of the spread: a median."""
    x, y = _values(first, table), _values(second, table)
    steps = np.diff([x, y], axis=1)
    swings = ((steps.max(axis=1) > 0) & (steps.min(axis=1) < 0)).all(axis=0)  # counters do not
    x, y = x[:, swings], y[:, swings]
    least = np.hypot(x.mean(axis=0) - y.mean(axis=0), x.std(axis=0) - y.std(axis=0))
    if not swings.any() or np.median(least / x.std(axis=0)) >= OTHER:
        return np.inf  # no shift makes it less
    y = np.roll(y, -_late(first, second, table), 0)
    return float(np.median(np.sqrt(((x - y) ** 2).mean(axis=0)) / x.std(axis=0)))
