# SPDX-License-Identifier: Apache-2.0
"""A fixed-base tree in the x-z plane for `substep`: the compiled recursion, on arrays."""
from collections.abc import Sequence
import math
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.broadcasting import Array, common, rows
from leo_sim.common.compiled import compiled_without_gil
from leo_sim.description.urdf import Joint
from leo_sim.dynamics.free_motion import Stateless
from leo_sim.dynamics.impulses import at, Factor, kicked
from leo_sim.dynamics.inertia_inverse import inverted
from leo_sim.dynamics.planar import Planar, POSE, poses, Tree, tree_of, weighed, World


def is_flat(joints: Sequence[Joint]) -> bool:
    """Whether all joints move in the x-z plane."""
    try:
        tree_of(joints)
    except UserError:
        return False
    return True


class Flat(Stateless, Planar):
    """The numbers of `Rigid`, for trees in the x-z plane."""

    def kicked(self, q: Array, dq: Array, diagonal: Any, driving: Any, held: Any, h: Any
               ) -> tuple[Any, Factor]:
        """See `Free`; here all at once."""
        size, h = q.shape[-1], np.asarray(h)
        shape = common(self.leading(q, dq), diagonal.shape[:-1], driving.shape[:-1],
                       held.shape[:-1], h.shape[:-1])
        states = rows(q, shape, size, True), rows(dq, shape, size, True)
        given = rows(diagonal, shape, size), rows(driving, shape, size), rows(held, shape, size)
        inverse, rates = np.empty((math.prod(shape), size, size)), np.empty(states[1].shape)
        _kick(self.tree, self.world(shape), *states, *given, rows(h, shape, 1), inverse, rates)
        return rates.reshape(*shape, size), Factor.of(inverse.reshape(*shape, size, size))


@compiled_without_gil
def _kick(tree: Tree, world: World, q: Array, dq: Array, diagonal: Array, driving: Array,
          held: Array, h: Array, inverse: Array, rates: Array) -> None:
    """Fill the inverse of the inertia with the diagonal, (N, J, J), and rates, (N, J)."""
    size = q.shape[1]
    pose, lever = np.zeros((tree.kind.shape[0], POSE)), np.empty((3, size))
    bias, mean, none = np.empty_like(dq), np.empty_like(dq), np.empty((0, size, size))
    for n in range(q.shape[0]):
        answer, step = inverse[n], h[at(h, n), 0]
        poses(tree, n, q, dq, pose)
        weighed(tree, world, n, pose, lever, inverse, bias)
        for j in range(size):
            answer[j, j] += diagonal[at(diagonal, n), j]
        inverted(size, 0, answer)
        kicked(n, answer, held, bias, dq, 0.5 * step, mean)
        poses(tree, n, q, mean, pose)
        weighed(tree, world, n, pose, lever, none, bias)
        kicked(n, answer, driving, bias, dq, step, rates)
