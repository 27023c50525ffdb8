# SPDX-License-Identifier: Apache-2.0
"""A fixed-base tree with one joint that moves: constant inertia, and a load that turns with it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.urdf import Body, Joint
from leo_sim.dynamics.free_motion import Stateless
from leo_sim.dynamics.rigid import Rigid


class Single(Stateless):
    """The equations of motion of one joint, as `Rigid` has them.

    The rotation of a hinge is linear in the cosine and the sine of its angle, so gravity and
    external forces load it by a + b cos q + c sin q. They load a slide by a constant.
    """

    def __init__(self, joints: Sequence[Joint], bodies: Mapping[str, Body], gravity: Numbers):
        tree = Rigid(joints, bodies, gravity)
        ahead, aside, behind = (tree.load(np.array([a])) for a in (0.0, 0.5 * np.pi, np.pi))
        self._mass = tree.mass_and_bias(np.zeros(1), np.zeros(1))[0]
        self._mean, self._cosine = 0.5 * (ahead + behind), 0.5 * (ahead - behind)
        self._sine = aside - self._mean

    def mass_and_bias(self, q: Array, dq: Array) -> tuple[Any, Any]:
        """Inertia (..., 1, 1) and bias torque (..., 1); the speed adds none."""
        return self._mass, -self.load(q)

    def load(self, q: Array) -> Any:
        """Torque of gravity and external forces at the joint, N m, (..., 1), along +q."""
        return self._mean + self._cosine * np.cos(q) + self._sine * np.sin(q)
