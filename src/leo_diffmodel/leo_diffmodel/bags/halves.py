# SPDX-License-Identifier: Apache-2.0
"""Joint states of several publishers that have a part of the joints each, joined by time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .rows import Floats, Stamps, Table

NEAR = 1.5
"""Periods of a half from one of its states to the next: across more nothing is made up."""


def at_the_fastest(tables: list[Table], columns: list[list[int]]) -> Table:
    """The columns of all halves at the times of the first, where each says something near."""
    clock, base, width = _clock(tables), tables[0], sum(map(len, columns))
    fields: list[Floats | None] = [
        None if all(half.fields[k] is None for half in tables)
        else np.full((len(base.log), width), np.nan) for k in range(3)]  # fmt: skip
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
