# SPDX-License-Identifier: Apache-2.0
"""Several publishers on one topic of joint states, which frame_id and names of joints tell apart.

Two halves of a robot, each with its own joints, are joined by time. Of two that publish the same
joints one is read. Two that no message tells apart are refused, as their states alternate.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError

from .contents import Logged
from .types import Floats, Stamps

FEWEST = 3
"""Messages of a publisher; fewer are damaged ones, or latched."""
NEAR = 1.5
"""Periods of a half from one of its states to the next: across more nothing is made up."""
SWITCHES = 0.2
"""Share of the states: two publishers take turns in so many; a gap, a reset or a jump is one."""
APART = 0.02
"""rad (m): the least that two are apart, above any encoder's resolution."""
NEARER = 10.0
"""Times: so much nearer than the last state is one before it where two take turns."""
FASTER = 3.0
"""Times the larger speed at both ends: a joint goes no farther than that between two states."""
FEWEST_TURNS = 20
"""States that show whether two take turns or joints jump."""


class Publisher(NamedTuple):
    """Who sent a state, as far as the message says: its frame_id, its names of joints."""

    frame: str
    names: tuple[str, ...]


class Row(NamedTuple):
    """One message: its sender, the columns it fills, its fields in our order (NaN elsewhere)."""

    publisher: Publisher
    ours: tuple[int, ...]
    logged: Logged
    stamp_ns: int
    position: Floats | None
    velocity: Floats | None
    effort: Floats | None


class Table(NamedTuple):
    """Rows as columns: times [ns] (T,), fields (T, J) or None where no message has one."""

    log: Stamps
    published: Stamps
    stamp: Stamps
    fields: tuple[Floats | None, ...]


def together(
    rows: Sequence[Row], joints: Sequence[str], topic: str
) -> tuple[Table, tuple[str, ...]] | None:
    """All joints' states, and what was done about several publishers, one line each.

    None where some joint is in no message; two publishers that nothing tells apart are refused.
    """
    parts: dict[Publisher, list[Row]] = defaultdict(list)
    for row in rows:
        if row.ours:
            parts[row.publisher].append(row)
    found = sorted(parts.values(), key=len, reverse=True)
    whole = [part for part in found if len(part[0].ours) == len(joints)]
    return _one(whole, joints, topic) if whole else _joined(found, joints, topic)


def _one(
    parts: list[list[Row]], joints: Sequence[str], topic: str
) -> tuple[Table, tuple[str, ...]]:
    """The publisher with the most messages, with those that spoke before or after it."""
    first = parts[0]
    rivals = [part for part in parts[1:] if _overlap(first, part)]
    others = [part for part in parts[1:] if not _overlap(first, part)]
    kept = sorted(chain(first, *others), key=lambda row: row.logged.log_ns)
    made = _table(kept, len(joints))
    _refuse_turns(made, joints, topic)
    return made, (_second([first, *rivals], joints, topic),) if rivals else ()


def _joined(
    parts: list[list[Row]], joints: Sequence[str], topic: str
) -> tuple[Table, tuple[str, ...]] | None:
    """Halves of a robot: each joint from who says it most often, at the times of the fastest."""
    source = {j: part for part in reversed(parts) for j in part[0].ours}
    if len(source) < len(joints):
        return None
    used = [part for part in parts if any(part is s for s in source.values())]
    doubled = [
        [a, b]
        for k, a in enumerate(parts)
        for b in parts[k + 1 :]
        if set(a[0].ours) & set(b[0].ours) and _overlap(a, b)
    ]
    tables = [_table(part, len(joints)) for part in used]
    columns = [[j for j, s in source.items() if s is part] for part in used]
    for half, mine in zip(tables, columns, strict=True):
        only = half._replace(fields=tuple(f if f is None else f[:, mine] for f in half.fields))
        _refuse_turns(only, [joints[j] for j in mine], topic)
    words = '; '.join(
        f'{", ".join(joints[j] for j in sorted(mine))} at {_rate(part):.3g} Hz'
        for part, mine in zip(used, columns, strict=True)
    )
    return _at_the_fastest(tables, columns), (
        *(_second(pair, joints, topic) for pair in doubled),
        f'{len(used)} publishers on {topic} have a part of the joints each ({words}); '
        'joined by time, the slower ones interpolated',
    )


def _table(rows: Sequence[Row], width: int) -> Table:
    missing = np.full(width, np.nan)
    fields = (
        None
        if all(row[k] is None for row in rows)
        else np.array([missing if row[k] is None else row[k] for row in rows], dtype=float)
        for k in (4, 5, 6)
    )
    log = np.array([row.logged.log_ns for row in rows], dtype=np.int64)
    published = np.array([row.logged.published_ns for row in rows], dtype=np.int64)
    stamp = np.array([row.stamp_ns for row in rows], dtype=np.int64)
    return Table(log, published, stamp, tuple(fields))


def _overlap(a: list[Row], b: list[Row]) -> bool:
    if min(len(a), len(b)) < FEWEST:
        return False
    return a[0].logged.log_ns < b[-1].logged.log_ns and b[0].logged.log_ns < a[-1].logged.log_ns


def _second(parts: list[list[Row]], joints: Sequence[str], topic: str) -> str:
    common = set.intersection(*(set(part[0].ours) for part in parts))
    words = ' and '.join(f'{_described(part)} at {_rate(part):.3g} Hz' for part in parts)
    return (
        f'{len(parts)} publishers of {", ".join(joints[j] for j in sorted(common))} on {topic}: '
        f'{words}; the first is read (frame_id: in a topic map chooses another)'
    )


def _described(part: list[Row]) -> str:
    frame, names = part[0].publisher
    return f'frame_id {frame!r} with {len(names)} joint{"s" * (len(names) > 1)}'


def _rate(part: list[Row]) -> float:
    """Messages per second of log time; 0 for one."""
    seconds = (part[-1].logged.log_ns - part[0].logged.log_ns) * 1e-9
    return (len(part) - 1) / seconds if seconds > 0 else 0.0


def _at_the_fastest(tables: list[Table], columns: list[list[int]]) -> Table:
    """The columns of all halves at the times of the first, where each says something near."""
    clock, base, width = _clock(tables), tables[0], sum(map(len, columns))
    fields: list[Floats | None] = [
        None
        if all(half.fields[k] is None for half in tables)
        else np.full((len(base.log), width), np.nan)
        for k in range(3)
    ]
    known = np.ones(len(base.log), dtype=bool)
    for half, mine in zip(tables, columns, strict=True):
        at, own = getattr(base, clock), getattr(half, clock)
        known &= True if half is base else _near(at, own)
        for whole, values in zip(fields, half.fields, strict=True):
            if whole is not None and values is not None:
                part = values[:, mine]
                whole[:, mine] = part if half is base else _at(at, own, part)
    kept = tuple(None if f is None else f[known] for f in fields)
    return Table(base.log[known], base.published[known], base.stamp[known], kept)


def _clock(tables: list[Table]) -> str:
    """`stamp` where all stamps go forward on one clock, by the time they took; else `log`."""
    if any((np.diff(half.stamp) < 0).any() or not half.stamp.any() for half in tables):
        return 'log'
    delays = [float(np.median(half.log - half.stamp)) for half in tables]
    steps = [float(np.median(np.diff(half.log))) if len(half.log) > 1 else 0.0 for half in tables]
    return 'log' if np.ptp(delays) > max(steps) else 'stamp'


def _at(t: Stamps, own: Stamps, values: Floats) -> Floats:
    at, x = (t - own[0]).astype(float), (own - own[0]).astype(float)
    return np.column_stack([np.interp(at, x, column) for column in values.T])


def _near(t: Stamps, own: Stamps) -> NDArray[np.bool_]:
    """Say which times [ns] (T,) lie between two states of a half (N,) that follow each other."""
    if len(own) < 2:
        return np.isin(t, own)
    after = np.searchsorted(own, t)
    last = np.clip(after, 1, len(own) - 1)
    steps = np.diff(own)
    follow = steps[last - 1] <= NEAR * float(np.median(steps))
    return np.asarray(((after > 0) & (after < len(own)) & follow) | np.isin(t, own))


def _refuse_turns(made: Table, joints: Sequence[str], topic: str) -> None:
    q = made.fields[0]
    if q is None or len(q) < FEWEST_TURNS:
        return
    back = float(np.mean(np.diff(made.stamp) < 0))
    apart = _apart(q) & ~_moved(made, q)
    if max(back, float(apart.mean(axis=0).max())) <= SWITCHES:
        return
    j = int(apart.sum(axis=0).argmax())
    step = np.abs(np.diff(q[:, j], axis=0))[3:][apart[:, j]]
    what = (
        f'values of {joints[j]} {np.median(step):.2g} apart in {apart[:, j].mean():.0%}'
        if step.size
        else f'stamps that go back in {back:.0%}'
    )
    raise UserError(
        f'two publishers take turns on {topic} ({what} of the steps), and neither frame_id nor '
        'names tell them apart; record again with one of them, or each on its own topic'
    )


def _moved(made: Table, q: Floats) -> NDArray[np.bool_]:
    """Say which of these steps the joint made by its own speed, as one that chatters does."""
    dq = made.fields[1]
    if dq is None:
        return np.zeros(q[4:].shape, dtype=bool)
    seconds = np.abs(np.diff(made.stamp))[3:, None] * 1e-9
    speed = np.fmax(np.abs(dq[4:]), np.abs(dq[3:-1]))
    return np.asarray(np.abs(q[4:] - q[3:-1]) < FASTER * speed * seconds)


def _apart(q: Floats) -> NDArray[np.bool_]:
    """Say which steps, from the fifth state on (T - 4, J), go to where the states before were."""
    last = np.abs(q[4:] - q[3:-1])
    before = np.min([np.abs(q[4:] - q[4 - k : -k]) for k in (2, 3, 4)], axis=0)
    return np.asarray((last > APART) & (last > NEARER * before))
