# SPDX-License-Identifier: Apache-2.0
"""A fixed-base tree in the x-z plane for `leo_sim.substep`: the compiled recursion, by rows."""
from collections.abc import Sequence
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.engines.planar import Planar, tree_of
from leo_sim.engines.stateless import Stateless
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

    def mass_and_bias(self, q: Any, dq: Any) -> tuple[list[list[Any]], list[Any]]:
        """Rows of the lower triangle of the joint-space inertia, and bias torques."""
        mass, bias = super().mass_and_bias(*np.broadcast_arrays(q, dq))
        rows = [[mass[..., i, k] for k in range(i + 1)] for i in range(q.shape[-1])]
        return rows, list(np.moveaxis(bias, -1, 0))

    def bias(self, q: Any, dq: Any) -> list[Any]:
        """The bias torques alone."""
        return self.mass_and_bias(q, dq)[1]

    def load(self, q: Any) -> Any:
        """Torque of gravity and external forces at the joints, N m, (..., J), along +q."""
        return -super().mass_and_bias(q, np.zeros_like(q))[1]
