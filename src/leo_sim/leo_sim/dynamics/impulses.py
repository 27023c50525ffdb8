# SPDX-License-Identifier: Apache-2.0
"""Impulses that bring rates to rest, to a stop or to the edge of a dead zone (Moreau).

Each is solved exactly for its joint; several are swept until they agree.
"""

import math
from typing import Any, NamedTuple, Self

import numpy as np

from leo_sim.common.broadcasting import Array, common, rows
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil
from leo_sim.dynamics.inertia_inverse import inverted

SWEEPS = 50
SETTLED = 1e-12  # rad/s


class Contact(NamedTuple):
    """What may push in a substep; fields (..., J).

    Attributes:
        level: Largest dry friction, N m; None without.
        stops: Lowest and highest angle rad; None without.
        gap: Width of the dead zone, rad; None without.
        rotor: Effective inertia of the motor sides, kg m2.
        q, dq: Angles and rates at the kick.
        offset: Motor angle minus joint angle, rad, before the kick.
        h: s.
    """

    level: Any
    stops: Any
    gap: Any
    rotor: Any
    q: Any
    dq: Any
    offset: Any
    h: Any


class Factor:
    """The inverse of an inertia (..., J, J) plus a diagonal (..., J)."""

    def __init__(self, mass: Any, diagonal: Array):
        size = mass.shape[-1]
        diagonal = np.asarray(diagonal, dtype=float)
        if size == 1:
            self.inverse = 1.0 / (mass + diagonal[..., None])
            return
        shape = common(mass.shape[:-2], diagonal.shape[:-1])
        inverse = np.empty((math.prod(shape), size, size))
        invert(rows(mass, shape, (size, size)), rows(diagonal, shape, size), inverse)
        self.inverse = inverse.reshape(*shape, size, size)

    @classmethod
    def of(cls, inverse: Any) -> Self:
        """From an inverse (..., J, J) already at hand."""
        factor = cls.__new__(cls)
        factor.inverse = inverse
        return factor

    def solve(self, right: Array) -> Any:
        """Accelerations (..., J) under the torques `right` (..., J)."""
        size = self.inverse.shape[-1]
        if size == 1:
            return self.inverse[..., 0] * right
        shape = common(self.inverse.shape[:-2], right.shape[:-1])
        out = np.empty((math.prod(shape), size))
        times(rows(self.inverse, shape, (size, size)), rows(right, shape, size), out)
        return out.reshape(*shape, size)

    def response(self, joint: int) -> Any:
        """Rates (..., J) that a unit impulse at a joint causes."""
        return self.inverse[..., joint, :]


@compiled_without_gil
def invert(mass: Array, diagonal: Array, inverse: Array) -> None:
    """Fill inverse (N, J, J) with that of mass plus a diagonal (N, J)."""
    size = mass.shape[1]
    for n in range(inverse.shape[0]):
        a = inverse[n]
        for i in range(size):
            for j in range(size):
                a[i, j] = mass[at(mass, n), i, j]
            a[i, i] += diagonal[at(diagonal, n), i]
        inverted(size, 0, a)


@compiled_without_gil
def times(matrix: Array, vector: Array, out: Array) -> None:
    """Fill out (N, J) with matrices (N, J, J) times vectors (N, J)."""
    size = out.shape[1]
    for n in range(out.shape[0]):
        left, right = at(matrix, n), at(vector, n)
        for i in range(size):
            total = 0.0
            for j in range(size):
                total += matrix[left, i, j] * vector[right, j]
            out[n, i] = total


def settled(contact: Contact, factor: Factor, dq: Array, motor: Any) -> tuple[Any, Any]:
    """Rates of joints and motor sides after all impulses.

    Args:
        contact: What may push.
        factor: Of the inertia of the links.
        dq: Rates without impulses, (..., J).
        motor: Rates of the motor sides without impulses; None without dead zones.
    """
    if contact.level is None and contact.gap is None and _clear(contact, dq):
        return dq, motor
    size = np.shape(dq)[-1]
    low, high = contact.stops or (-np.inf, np.inf)
    play = (0.0, 1.0, 0.0) if contact.gap is None else (contact.gap, contact.rotor, contact.offset)
    fields = [
        0.0 if contact.level is None else contact.level,
        low,
        high,
        *play,
        contact.q,
        contact.dq,
    ]
    moved = [dq, 0.0 if motor is None else motor]
    shape = common(
        *(np.shape(f)[:-1] for f in (*fields, *moved, contact.h)), factor.inverse.shape[:-2]
    )
    rates, speeds = (rows(m, shape, size, True).copy() for m in moved)
    _sweep(
        rates,
        speeds,
        rows(factor.inverse, shape, (size, size)),
        rows(contact.h, shape, 1),
        *(rows(f, shape, size) for f in fields),
    )
    rates, speeds = (m.reshape(*shape, size) for m in (rates, speeds))
    return rates, None if motor is None else speeds


def _clear(contact: Contact, dq: Array) -> bool:
    """Whether no joint reaches a stop, as `_stopped` has it."""
    low, high = contact.stops or (-np.inf, np.inf)
    way = dq * np.maximum(contact.h, 1e-12)
    return bool(((low - contact.q <= way) & (way <= high - contact.q)).all())


@compiled_without_gil
def _sweep(
    dq: Array,
    motor: Array,
    answers: Array,
    h: Array,
    level: Array,
    low: Array,
    high: Array,
    gap: Array,
    rotor: Array,
    offset: Array,
    q: Array,
    before: Array,
) -> None:
    """Change rates (N, J) of joints and motors in place; fields are (N, J) or (1, J)."""
    given = np.empty((3, dq.shape[1]))
    for n in range(dq.shape[0]):
        given[:] = 0.0
        swept(n, dq, motor, answers, h, level, low, high, gap, rotor, offset, q, before, given)


@compiled_in_place
def swept(
    n: int,
    dq: Array,
    motor: Array,
    answers: Array,
    h: Array,
    level: Array,
    low: Array,
    high: Array,
    gap: Array,
    rotor: Array,
    offset: Array,
    q: Array,
    before: Array,
    given: Array,
) -> Any:
    """Change row n alone; given (3, J) are impulses of friction, stops and play, none at first.

    One friction that acts alone is right at once.
    """
    a, step = at(answers, n), max(h[at(h, n), 0], 1e-12)
    dry, wide, here = at(level, n), at(gap, n), at(q, n)
    for _ in range(SWEEPS):
        moved, acting = 0.0, 0
        for kind in range(3):
            for j in range(dq.shape[1]):
                own, was, share = answers[a, j, j], given[kind, j], 0.0
                free = dq[n, j] - own * was
                if kind == 0 and level[dry, j] > 0.0:
                    total = _friction(before[at(before, n), j], free, level[dry, j] * step, own)
                    acting += 1
                elif kind == 1:
                    total = _stopped(
                        free,
                        low[at(low, n), j] - q[here, j],
                        high[at(high, n), j] - q[here, j],
                        step,
                        own,
                    )
                    acting += 2 if total != was else 0
                elif kind == 2 and gap[wide, j] > 0.0:
                    share = 1.0 / rotor[at(rotor, n), j]
                    apart = motor[n, j] - dq[n, j] + (share + own) * was
                    slip = offset[at(offset, n), j]
                    total = _gap(apart, slip, gap[wide, j], step) / (share + own)
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
def _friction(before: float, free: float, most: float, answer: float) -> Any:
    """Impulse of dry friction against the motion, exact for a constant driving torque.

    The joint may come to rest within the substep; then it stays there, or turns round and
    friction changes sides, as the driving torque is below or above the level.
    """
    reach = most * answer
    if before == 0.0:
        return -min(max(free, -reach), reach) / answer
    side = 1.0 if before > 0.0 else -1.0
    against = (before - free) * side
    slowed = against + reach
    if slowed > 0.0 and abs(before) < slowed:
        rest = abs(before) / slowed
        return (-(1.0 - rest) * max(against - reach, 0.0) * side - free) / answer
    return -most * side


@compiled_in_place
def _gap(apart: float, offset: float, width: float, h: float) -> Any:
    """What a motor side is too fast for its link to keep the play within its width."""
    half = 0.5 * width
    return apart - min(max(apart, (-half - offset) / h), (half - offset) / h)


@compiled_in_place
def at(values: Array, n: int) -> Any:
    """Index of row n in rows as `broadcasting.rows` makes them."""
    return n if values.shape[0] > 1 else 0


@compiled_in_place
def kicked(
    n: int, answer: Array, torque: Array, bias: Array, dq: Array, h: float, rates: Array
) -> Any:
    """Fill row n of rates (N, J) with those after h s of a torque less the bias.

    The answer is the inverse of the inertia, (J, J).
    """
    t = at(torque, n)
    for i in range(rates.shape[1]):
        total = 0.0
        for j in range(rates.shape[1]):
            total += answer[i, j] * (torque[t, j] - bias[n, j])
        rates[n, i] = dq[n, i] + h * total
