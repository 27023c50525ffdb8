# SPDX-License-Identifier: Apache-2.0
"""The ground under a robot, and the spheres that touch it.

A sphere that is depth d in the ground and sinks at the rate v is pushed out by
max(0, stiffness d + damping v), and held against sliding by at most friction times that.
"""
from collections.abc import Sequence
from typing import Any

from numba import njit
import numpy as np

from leo_sim.effects.base import Ground
from leo_sim.engines.planar import jacobian, poses, tree_of
from leo_sim.robot import Contact, Robot


class Spheres:
    """The spheres of a robot over a ground."""

    def __init__(self, robot: Robot, ground: Ground):
        self.names = tuple(contact.name for contact in robot.contacts)
        self._tree = tree_of(robot.joints)
        links = {joint.child: i for i, joint in enumerate(robot.joints)}
        self._links = np.array([links[c.link] for c in robot.contacts])
        self._places = np.array([[c.x, c.z, c.radius] for c in robot.contacts])
        self._slope = np.asarray(ground.slope, dtype=float)
        self.stiffness = _each(robot.contacts, 'stiffness', ground.stiffness)
        self.damping = _each(robot.contacts, 'damping', ground.damping)
        self.friction = np.asarray(ground.friction, dtype=float)[..., None]

    def over(self, q: Any) -> tuple[Any, Any, Any]:
        """Height over the ground m (..., P), its rate and the sliding speed per joint rate.

        Args:
            q: True angles (..., J).

        Returns:
            Heights (..., P), normal and tangent Jacobians (..., P, J).
        """
        shape = np.broadcast_shapes(q.shape[:-1], self._slope.shape)
        size, points = q.shape[-1], len(self._links)
        rows = np.ascontiguousarray(np.broadcast_to(q, (*shape, size))).reshape(-1, size)
        slope = np.ascontiguousarray(np.broadcast_to(self._slope, shape)).reshape(-1)
        height = np.empty((len(rows), points))
        normal, tangent = np.empty((2, len(rows), points, size))
        _over(self._tree, self._links, self._places, slope, rows, height, normal, tangent)
        return (height.reshape(*shape, points), normal.reshape(*shape, points, size),
                tangent.reshape(*shape, points, size))


def _each(contacts: Sequence[Contact], name: str, of_ground: Any) -> Any:
    """A figure of every sphere: its own, or that of the ground, (..., P)."""
    figures = [of_ground if getattr(c, name) is None else getattr(c, name) for c in contacts]
    return np.stack(np.broadcast_arrays(*(np.asarray(f, dtype=float) for f in figures)), axis=-1)


@njit(cache=True)
def _over(tree, links, places, slope, q, height, normal, tangent):  # type: ignore[no-untyped-def]
    """Fill height (N, P) and Jacobians (N, P, J) for states (N, J)."""
    size = q.shape[1]
    pose, lever, still = np.zeros((tree.kind.shape[0], 10)), np.empty((3, size)), np.zeros(size)
    for n in range(q.shape[0]):
        poses(tree.kind, tree.parent, tree.column, tree.turn, tree.sense, tree.place, q[n],
              still, pose)
        up, along = np.cos(slope[n]), np.sin(slope[n])
        for p in range(links.shape[0]):
            i = links[p]
            c, s = np.cos(pose[i, 0]), np.sin(pose[i, 0])
            x = pose[i, 1] + c * places[p, 0] - s * places[p, 1]
            z = pose[i, 2] + s * places[p, 0] + c * places[p, 1]
            height[n, p] = up * z - along * x - places[p, 2]
            jacobian(tree.kind, tree.parent, tree.column, tree.sense, pose, i,
                     x + along * places[p, 2], z - up * places[p, 2], lever)
            for j in range(size):
                normal[n, p, j] = up * lever[1, j] - along * lever[0, j]
                tangent[n, p, j] = up * lever[0, j] + along * lever[1, j]
