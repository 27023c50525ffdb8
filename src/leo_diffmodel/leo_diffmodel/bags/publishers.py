# SPDX-License-Identifier: Apache-2.0
"""Several publishers on one topic of joint states, told apart by frame_id and names of joints.

Two halves of a robot, each with its own joints, are joined by time. Of two that publish the same
joints one is read. Two that no message tells apart are refused.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from .rows import Floats, Publisher, Row, Stamps, Table, table
from .taking_turns import refuse_turns

FEWEST = 3
"""Messages of a publisher; fewer are damaged ones, or latched."""
NEAR = 1.5
"""Periods of a half from one of its states to the next: across more nothing is made up."""


def together(
    rows: Sequence[Row], joints: Sequence[str], topic: str
) -> tuple[Table, tuple[str, ...]] | None:
    """All joints' states, and what was done about several publishers, one line each.

    Returns:
        None where some joint is in no message.

    Raises:
        UserError: two publishers of the same joints that nothing tells apart.
    """
    parts: dict[Publisher, list[Row]] = defaultdict(list)
    for row in rows:
        if row.ours:
            parts[row.publisher].append(row)
    found = sorted(parts.values(), key=len, reverse=True)
    whole = [part for part in found if len(part[0].ours) == len(joints)]
    if whole:
        return _one(whole, joints, topic)
    return _joined(found, joints, topic)


def _one(
    parts: list[list[Row]], joints: Sequence[str], topic: str
) -> tuple[Table, tuple[str, ...]]:
    """The publisher with the most messages, with those that spoke before or after it."""
    first = parts[0]
    beside = [part for part in parts[1:] if _overlap(first, part)]
    others = [part for part in parts[1:] if not _overlap(first, part)]
    kept = sorted(chain(first, *others), key=lambda row: row.logged.log_ns)
    made = table(kept, len(joints))
    refuse_turns(made, joints, topic)
    told = (_second([first, *beside], joints, topic),) if beside else ()
    return made, told


def _joined(
    parts: list[list[Row]], joints: Sequence[str], topic: str
) -> tuple[Table, tuple[str, ...]] | None:
    """Halves of a robot: each joint from who says it most often, at the times of the fastest."""
    source = {j: part for part in reversed(parts) for j in part[0].ours}
    if len(source) < len(joints):
        return None
    used = [part for part in parts if any(part is s for s in source.values())]
    told = [_second(twice, joints, topic) for twice in _doubled(parts)]
    tables = [table(part, len(joints)) for part in used]
    columns = [[j for j, s in source.items() if s is part] for part in used]
    for half, mine in zip(tables, columns, strict=True):
        refuse_turns(_only(half, mine), [joints[j] for j in mine], topic)
    words = '; '.join(
        f'{", ".join(joints[j] for j in sorted(mine))} at {_rate(part):.3g} Hz'
        for part, mine in zip(used, columns, strict=True)
    )
    return at_the_fastest(tables, columns), (
        *told,
        f'{len(used)} publishers on {topic} have a part of the joints each ({words}); '
        'joined by time, the slower ones interpolated',
    )


def _doubled(parts: list[list[Row]]) -> list[list[list[Row]]]:
    """Pairs of publishers that have a joint in common and speak at the same time."""
    return [
        [a, b]
        for k, a in enumerate(parts)
        for b in parts[k + 1 :]
        if set(a[0].ours) & set(b[0].ours) and _overlap(a, b)
    ]


def _overlap(a: list[Row], b: list[Row]) -> bool:
    """Say whether two publishers spoke at the same time, and not one after the other."""
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


def _only(half: Table, columns: list[int]) -> Table:
    return half._replace(fields=tuple(f if f is None else f[:, columns] for f in half.fields))


def at_the_fastest(tables: list[Table], columns: list[list[int]]) -> Table:
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
    """Values (N, K) of one clock [ns] (N,) at other times [ns] (T,)."""
    at, x = (t - own[0]).astype(float), (own - own[0]).astype(float)
    return np.column_stack([np.interp(at, x, column) for column in values.T])


def _near(t: Stamps, own: Stamps) -> NDArray[np.bool_]:
    """Say which times [ns] (T,) lie between two states of a half (N,) that follow each other."""
    after = np.searchsorted(own, t)
    inside = (after > 0) & (after < len(own))
    last = np.clip(after, 1, max(len(own) - 1, 1))
    apart = own[last] - own[last - 1] if len(own) > 1 else np.full(len(t), np.inf)
    period = float(np.median(np.diff(own))) if len(own) > 1 else 0.0
    return np.asarray((inside & (apart <= NEAR * period)) | np.isin(t, own))
