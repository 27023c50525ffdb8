# SPDX-License-Identifier: Apache-2.0
"""Impulses that bring rates to rest, to a stop or to the edge of a dead zone (Moreau).

Each is solved exactly for its joint; several are swept until they agree.
"""

from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, common, Numbers, rows
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil
from leo_sim.dynamics.inertia import at

SWEEPS = 50
SETTLED = 1e-12  # rad/s
STILL = 1e-10  # rad/s: what moves slower is at rest, on neither side of friction


class Contact(NamedTuple):
    """What may push in a substep, (..., J); in compiled functions rows (N or 1, J)."""

    level: Any  # largest dry friction, N m; 0 without
    low: Any  # stops, rad; infinite without
    high: Any
    gap: Any  # width of the dead zone, rad; 0 without
    rotor: Any  # effective inertia of the motor sides, kg m2
    offset: Any  # motor angle minus joint angle, rad, before the kick
    q: Any  # angles and rates at the kick
    dq: Any


def settled(
    contact: Contact, inverse: Array, h: Numbers, dq: Array, motor: Any
) -> tuple[Any, Any]:
    """Rates (..., J) of joints and motor sides after all impulses of h s.

    Dq and motor are those without impulses; there is no motor side without dead zones. Inverse is
    that of the inertia, (..., J, J).
    """
    size, moved = np.shape(dq)[-1], [dq, 0.0 if motor is None else motor]
    shape = common(*(np.shape(f)[:-1] for f in (*contact, *moved, h)), inverse.shape[:-2])
    rates, speeds = (rows(m, shape, size, True).copy() for m in moved)
    answers = rows(inverse, shape, (size, size))
    parts = Contact(*(rows(f, shape, size) for f in contact))
    _sweep(rates, speeds, answers, rows(h, shape, 1), parts)
    rates, speeds = (m.reshape(*shape, size) for m in (rates, speeds))
    return rates, None if motor is None else speeds


def stopped(low: Numbers, high: Numbers, q: Array, dq: Array, h: Numbers) -> bool:
    """Whether a joint reaches a stop within h s, as `_stopped` has it."""
    way = dq * np.maximum(h, 1e-12)
    return not ((low - q <= way) & (way <= high - q)).all()


@compiled_without_gil
def _sweep(dq: Array, motor: Array, answers: Array, h: Array, contact: Contact) -> None:
    given = np.empty((3, dq.shape[1]))
    for n in range(dq.shape[0]):
        given[:] = 0.0
        swept(n, dq, motor, answers, h, contact, given)


@compiled_in_place
def swept(
    n: int, dq: Array, motor: Array, answers: Array, h: Array, contact: Contact, given: Array
) -> Any:
    """Change row n alone; given (3, J) are impulses of friction, stops and play, none at first.

    One friction that acts alone is right at once.
    """
    a, step = at(answers, n), max(h[at(h, n), 0], 1e-12)
    level, low, high, gap, rotor, offset, q, before = contact
    dry, wide, here = at(level, n), at(gap, n), at(q, n)
    for _ in range(SWEEPS):
        moved, acting = 0.0, 0
        for kind in range(3):
            for j in range(dq.shape[1]):
                own, was, share = answers[a, j, j], given[kind, j], 0.0
                free = dq[n, j] - own * was
                if kind == 0 and level[dry, j] > 0.0:
                    reach = level[dry, j] * step * own
                    total = (slowed(before[at(before, n), j], free, reach) - free) / own
                    acting += 1
                elif kind == 1:
                    least = low[at(low, n), j] - q[here, j]
                    most = high[at(high, n), j] - q[here, j]
                    total = _stopped(free, least, most, step, own)
                    acting += 2 if total != was else 0
                elif kind == 2 and gap[wide, j] > 0.0:
                    share = 1.0 / rotor[at(rotor, n), j]
                    apart = motor[n, j] - dq[n, j] + (share + own) * was
                    slip = offset[at(offset, n), j]
                    total = too_fast(apart, slip, gap[wide, j], step) / (share + own)
                    acting += 2
                else:
                    continue
                change = total - was
                _push(n, a, j, change, dq, answers)
                motor[n, j] -= share * change
                given[kind, j] = total
                moved = max(moved, abs(change * own))
        if acting < 2 or not moved > SETTLED:
            break


@compiled_in_place
def _push(n: int, a: int, j: int, impulse: float, dq: Array, answers: Array) -> Any:
    """Change the rates of row n by an impulse at joint j; a is the row of the answers."""
    for k in range(dq.shape[1] if impulse != 0.0 else 0):
        dq[n, k] += answers[a, j, k] * impulse


@compiled_in_place
def _stopped(free: float, least: float, most: float, h: float, answer: float) -> Any:
    """Impulse of the stops, which are `least` and `most` away."""
    if least <= free * h and free * h <= most:
        return 0.0
    return (min(max(free, least / h), most / h) - free) / answer


@compiled_in_place
def slowed(before: float, free: float, reach: float) -> Any:
    """Rate after dry friction that changes it by `reach`, exact for a constant driving torque.

    The joint may come to rest within the substep; then it stays there, or turns round and
    friction changes sides, as the driving torque is below or above the level.
    """
    if before == 0.0:
        return free - min(max(free, -reach), reach)
    side = 1.0 if before > 0.0 else -1.0
    against, rest = (before - free) * side, before * side
    if against + reach > rest:
        left = 1.0 - rest / (against + reach)
        return -left * max(against - reach, 0.0) * side
    return free - reach * side


@compiled_in_place
def too_fast(apart: float, offset: float, width: float, h: float) -> Any:
    """By how much a motor side is too fast for its link to keep the play within its width."""
    half = 0.5 * width
    return apart - min(max(apart, (-half - offset) / h), (half - offset) / h)
