# SPDX-License-Identifier: Apache-2.0
"""A fixed-base tree in the x-z plane for `leo_sim.substep`: the compiled recursion, on arrays."""
from collections.abc import Sequence

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
