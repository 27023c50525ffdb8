# SPDX-License-Identifier: Apache-2.0
"""Two publishers of the same joints that no message tells apart, by how their states alternate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError

from .rows import Floats, Table

SWITCHES = 0.2
"""Share of the states: two publishers take turns in so many; a gap, a reset or a jump is one."""
APART = 0.02
"""rad (m): the least that two are apart, above any encoder's resolution."""
NEARER = 10.0
"""Times: so much nearer than the last state is one before it where two take turns."""
FASTER = 3.0
"""Times the larger speed at both ends: a joint goes no farther than that between two states."""
FEWEST = 20
"""States that tell turns from jumps."""


def refuse_turns(made: Table, joints: Sequence[str], topic: str) -> None:
    """Refuse states of two publishers that take turns, by their values or their stamps.

    Raises:
        UserError: they do.
    """
    q = made.fields[0]
    if q is None or len(q) < FEWEST:
        return
    back = float(np.mean(np.diff(made.stamp) < 0))
    apart = _apart(q) & ~_moved(made)
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


def _moved(made: Table) -> NDArray[np.bool_]:
    """Say which of these steps the joint made by its own speed, as one that chatters does."""
    q, dq = made.fields[:2]
    assert q is not None
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
