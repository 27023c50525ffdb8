# SPDX-License-Identifier: Apache-2.0
"""A fault that is found in several logs: one entry with the weighted mean of its estimates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
import math

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.base import Found
from leo_diffmodel.faults.mending import mended


def pooled(faults: Sequence[Found]) -> list[Found]:
    """One entry for each fault and joint, by all logs in which it is an error (or any)."""

    def which(f: Found) -> tuple[str, str]:
        return f.fault.name, f.joint

    groups = [list(g) for _, g in groupby(sorted(faults, key=which), which)]
    return sorted(map(_one, groups), key=lambda f: not f.error)


def all_mended(recordings: Sequence[Recording], faults: Sequence[Found]) -> list[Recording]:
    """Each recording without the errors that can be undone.

    A wrong unit or sign that the log itself shows is mended in the logs that show it, with the
    value of all of them; what only torques show is mended in every log, told by it or not.
    Stretches are left out of the log that they are of.
    """
    errors = pooled([f for f in faults if f.error and f.patch])
    out = []
    for r in recordings:
        own = [f for f in faults if f.bag == str(r.path) and f.error]
        shown = {(f.fault.name, f.joint) for f in own}
        here = [f for f in errors if f.evidence == 'balance' or (f.fault.name, f.joint) in shown]
        out.append(mended(r, [*(f for f in own if f.cuts), *here]))
    return out


def _one(group: Sequence[Found]) -> Found:
    """The mean of a fault's estimates, weighted by how sure they are."""
    sure = [f for f in group if f.error] or [*group]
    spread = np.array([max(np.hypot(f.sd, f.worst), 1e-12) for f in sure])
    weight = spread**-2 / (spread**-2).sum()
    first = sure[int(np.argmin(spread))]
    apart = [math.remainder(f.value - first.value, first.fault.turn) for f in sure]
    value = first.value + float(weight @ apart)
    bags = len({f.bag for f in sure})
    others = 'log' if bags == 2 else 'logs'
    more = f' (and in {bags - 1} other {others})' if bags > 1 else ''
    return replace(
        first,
        value=value,
        sd=float((spread**-2).sum() ** -0.5) if bags > 1 else first.sd,
        what=first.what + more,
    )
