# SPDX-License-Identifier: Apache-2.0
"""Which effects this data cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from leo_diffmodel.check.amplitudes import Apart, Reach
from leo_diffmodel.explain.settings import SETTINGS

MOST_TIMES = 1000.0


@dataclass(frozen=True)
class Pair:
    """Two effects that look alike here.

    Attributes:
        a, b: labels, effect:where.
        separable_nats: by which either could be told from the other at a typical size.
        seconds: data like these that telling them apart needs [s]; None where none would do.
        same_thing: they are equal in any data of this kind.
    """

    a: str
    b: str
    separable_nats: float
    seconds: float | None
    same_thing: bool

    def to_json(self) -> dict:
        """Plain values."""
        return asdict(self)


def alike(rows: Sequence[Reach], apart: Apart, seconds: float) -> list[Pair]:
    """The pairs that stay within the margin for a name, closest first.

    Effects that would not even show at their typical size are left out.

    Args:
        rows: all effects.
        apart: how far apart they are.
        seconds: how much data there is.
    """
    shown = np.array([(r.seconds_to_detect or np.inf) <= seconds for r in rows])
    near = np.minimum(apart.separable, apart.separable.T) < SETTINGS.gates.margin_nats
    close = apart.same | (near & shown & shown[:, None])
    found = [_pair(rows, apart, i, j, seconds) for i, j in np.argwhere(np.triu(close, 1))]
    return sorted(found, key=lambda p: (not p.same_thing, p.separable_nats))


def _pair(rows: Sequence[Reach], apart: Apart, i: int, j: int, seconds: float) -> Pair:
    same = bool(apart.same[i, j])
    nats = min(apart.separable[i, j], apart.separable[j, i])
    times = max(apart.longer[i, j], apart.longer[j, i])
    wanted = None if same or times > MOST_TIMES else float(seconds * times)
    return Pair(rows[i].label, rows[j].label, float(nats), wanted, same)


def groups(pairs: Sequence[Pair]) -> list[list[str]]:
    """The effects that are the same thing, class by class."""
    found: list[set[str]] = []
    for pair in (p for p in pairs if p.same_thing):
        touched = [g for g in found if g & {pair.a, pair.b}]
        found = [g for g in found if g not in touched] + [{pair.a, pair.b}.union(*touched)]
    return [sorted(g) for g in found]
