# SPDX-License-Identifier: Apache-2.0
"""A fixed-base tree in the x-z plane for `leo_sim.substep`: the compiled recursion, on arrays."""
from collections.abc import Sequence
import math
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.compiled import compiled
from leo_sim.engines.planar import dynamics, Planar, rows, tree_of
from leo_sim.engines.stateless import Stateless
from leo_sim.filled import common
from leo_sim.impulses import Factor, invert, row, times
from leo_sim.urdf import Joint


def is_flat(joints: Sequence[Joint]) -> bool:
    """Whether all joints move in the x-z plane."""
    try:
        tree_of(joints)
    except UserError:
        return False
    return True


class Flat(Stateless, Planar):
    """The same numbers as `Rigid`, for trees in the x-z plane."""

    def kicked(self, q: Any, dq: Any, diagonal: Any, driving: Any, held: Any, h: Any
               ) -> tuple[Any, Factor]:
        """See `Free`; here all at once."""
        size, h = q.shape[-1], np.asarray(h)
        shape = common(self.leading(q, dq), diagonal.shape[:-1], driving.shape[:-1],
                       held.shape[:-1], h.shape[:-1])
        states = rows(q, shape, size, True), rows(dq, shape, size, True)
        given = rows(diagonal, shape, size), rows(driving, shape, size), rows(held, shape, size)
        mass = np.empty((math.prod(shape), size, size))
        rates, inverse = np.empty((len(mass), size)), np.empty_like(mass)
        _kick(self.tree, self.world(shape), *states, *given, rows(h, shape, 1), mass, inverse,
              rates)
        return rates.reshape(*shape, size), Factor.of(inverse.reshape(*shape, size, size))


@compiled
def _kick(tree: Any, world: Any, q: Any, dq: Any, diagonal: Any, driving: Any, held: Any,
          h: Any, mass: Any, inverse: Any, rates: Any) -> None:
    """Fill mass (N, J, J), its inverse with the diagonal, and rates (N, J)."""
    bias, push, mean = np.empty_like(dq), np.empty_like(dq), np.empty_like(dq)
    none = np.empty((0, dq.shape[1], dq.shape[1]))
    dynamics(tree, world, q, dq, mass, bias)
    invert(mass, diagonal, inverse)
    _less(held, bias, push)
    times(inverse, push, mean)
    _ahead(dq, mean, h, 0.5, mean)
    dynamics(tree, world, q, mean, none, bias)
    _less(driving, bias, push)
    times(inverse, push, rates)
    _ahead(dq, rates, h, 1.0, rates)


@compiled
def _less(torque: Any, bias: Any, out: Any) -> None:
    for n in range(out.shape[0]):
        given = row(torque, n)
        for j in range(out.shape[1]):
            out[n, j] = given[j] - bias[n, j]


@compiled
def _ahead(dq: Any, faster: Any, h: Any, share: float, out: Any) -> None:
    for n in range(out.shape[0]):
        step = share * row(h, n)[0]
        for j in range(out.shape[1]):
            out[n, j] = dq[n, j] + step * faster[n, j]
