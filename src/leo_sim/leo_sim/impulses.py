# SPDX-License-Identifier: Apache-2.0
"""Impulses that bring rates to rest, to a stop or to the edge of a dead zone (Moreau).

Each is solved exactly for its joint; several are swept until they agree.
"""
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from leo_sim.engines.components import mul, sub
from leo_sim.engines.rigid import joined

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
    """L D L' of inertia rows (lower triangle, components) plus a diagonal (..., J)."""

    def __init__(self, rows: Sequence[Sequence[Any]], diagonal: Any, shape: tuple[int, ...]):
        self._shape, size = shape, len(rows)
        self._lower: list[list[Any]] = [[0.0] * size for _ in range(size)]
        self._pivot: list[Any] = []
        for i in range(size):
            pivot = rows[i][i] + diagonal[..., i]
            for k in range(i):
                entry = rows[i][k]
                for m in range(k):
                    weight = mul(self._lower[k][m], self._pivot[m])
                    entry = sub(entry, mul(self._lower[i][m], weight))
                self._lower[i][k] = entry / self._pivot[k]
                pivot = sub(pivot, mul(mul(self._lower[i][k], self._lower[i][k]),
                                       self._pivot[k]))
            self._pivot.append(pivot)

    def solve(self, right: Sequence[Any]) -> Any:
        """Accelerations (..., J) under the torques `right` (components)."""
        size, x = len(self._pivot), list(right)
        for i in range(size):
            for k in range(i):
                x[i] = sub(x[i], mul(self._lower[i][k], x[k]))
        x = [value / pivot for value, pivot in zip(x, self._pivot, strict=True)]
        for i in range(size - 1, -1, -1):
            for k in range(i + 1, size):
                x[i] = sub(x[i], mul(self._lower[k][i], x[k]))
        return joined(x, self._shape)

    def response(self, joint: int) -> Any:
        """Rates (..., J) that a unit impulse at a joint causes."""
        size = len(self._pivot)
        return self.solve([1.0 if i == joint else 0.0 for i in range(size)])


def settled(contact: Contact, factor: Factor, dq: Any, motor: Any) -> tuple[Any, Any]:
    """Rates of joints and motor sides after all impulses.

    Args:
        contact: What may push.
        factor: Of the inertia of the links.
        dq: Rates without impulses, (..., J).
        motor: Rates of the motor sides without impulses; None without dead zones.
    """
    joints = range(np.shape(dq)[-1])
    kinds = [kind for kind, figure in (('friction', contact.level), ('stop', contact.stops),
                                       ('gap', contact.gap)) if figure is not None]
    answers = [factor.response(j) for j in joints]
    given = {(kind, j): 0.0 for kind in kinds for j in joints}
    for _ in range(1 if len(given) == 1 else SWEEPS):
        moved = 0.0
        for kind, j in given:
            answer = answers[j][..., j]
            total, share = _LAWS[kind](contact, j, answer, dq, motor, given[kind, j])
            change = total - given[kind, j]
            dq = dq + answers[j] * change[..., None]
            if share is not None:
                motor = _set(motor, j, motor[..., j] - change * share)
            given[kind, j] = total
            moved = max(moved, float(np.max(np.abs(change * answer))))
        if not moved > SETTLED:
            break
    return dq, motor


def _friction(contact: Contact, j: int, answer: Any, dq: Any, motor: Any, given: Any
              ) -> tuple[Any, Any]:
    """Impulse of dry friction against the motion, exact for a constant driving torque.

    The joint may come to rest within the substep; then it stays there, or turns round and
    friction changes sides, as the driving torque is below or above the level.
    """
    before, free = contact.dq[..., j], dq[..., j] - answer * given
    reach = _column(contact.level, j) * _column(contact.h, 0) * answer
    side = np.where(before == 0, np.sign(free), np.sign(before))
    against = (before - free) * side
    slowed = against + reach
    rest = np.abs(before) / np.where(slowed > 0, slowed, np.inf)
    rests = (slowed > 0) & (rest < 1)
    turned = -(1.0 - rest) * np.maximum(against - reach, 0.0) * side
    after = np.where(rests, turned, free - reach * side)
    from_rest = free - np.clip(free, -reach, reach)
    return (np.where(before == 0, from_rest, after) - free) / answer, None


def _stop(contact: Contact, j: int, answer: Any, dq: Any, motor: Any, given: Any
          ) -> tuple[Any, Any]:
    """Impulse that keeps the joint between its stops at the end of the substep."""
    h = np.maximum(_column(contact.h, 0), 1e-12)
    free = dq[..., j] - answer * given
    low, high = ((limit[j] - contact.q[..., j]) / h for limit in contact.stops)
    return (np.clip(free, low, high) - free) / answer, None


def _gap(contact: Contact, j: int, answer: Any, dq: Any, motor: Any, given: Any
         ) -> tuple[Any, Any]:
    """Impulse of the motor side on the link that keeps the play within its width."""
    h = np.maximum(_column(contact.h, 0), 1e-12)
    width, rotor = _column(contact.gap, j), _column(contact.rotor, j)
    share = np.where(width > 0, 1.0 / rotor, 0.0)
    slip = motor[..., j] - dq[..., j] + (share + answer) * given
    half, offset = 0.5 * width, contact.offset[..., j]
    kept = np.clip(slip, (-half - offset) / h, (half - offset) / h)
    return np.where(width > 0, (slip - kept) / (share + answer), 0.0), share


_LAWS = {'friction': _friction, 'stop': _stop, 'gap': _gap}


def _column(figure: Any, j: int) -> Any:
    """Column j of an array (..., J) or (..., 1); a float as it is."""
    if not np.ndim(figure):
        return figure
    return figure[..., j if np.shape(figure)[-1] > 1 else 0]


def _set(values: Any, j: int, column: Any) -> Any:
    """A copy of `values` (..., J) with one column replaced."""
    columns = [values[..., i] for i in range(values.shape[-1])]
    columns[j] = column
    return joined(columns, np.shape(values))


