# SPDX-License-Identifier: Apache-2.0
"""Joint states as they came: who sent each, and all of them as columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .contents import Logged

Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]


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


def table(rows: Sequence[Row], width: int) -> Table:
    """Messages as columns; what a message lacks is NaN."""
    log = np.array([row.logged.log_ns for row in rows], dtype=np.int64)
    published = np.array([row.logged.published_ns for row in rows], dtype=np.int64)
    stamp = np.array([row.stamp_ns for row in rows], dtype=np.int64)
    fields = ([row[k] for row in rows] for k in (4, 5, 6))
    return Table(log, published, stamp, tuple(_column(values, width) for values in fields))


def _column(values: list[Any], width: int) -> Floats | None:
    """Stack one field; samples without it become NaN, None where no sample has it."""
    if all(value is None for value in values):
        return None
    missing = np.full(width, np.nan)
    return np.array([missing if value is None else value for value in values], dtype=float)
