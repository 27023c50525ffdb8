# SPDX-License-Identifier: Apache-2.0
"""The ground under a robot, and the spheres that touch it.

A sphere that is depth d in the ground and sinks at the rate v is pushed out by
max(0, stiffness d + damping v), and held against sliding by at most friction times that. Both act
where its centre stands over the ground, so that the spheres of a flat foot slide alike.
"""
from collections.abc import Sequence
from typing import Any

import numpy as np

from leo_sim.compiled import compiled_without_gil
from leo_sim.contact_kernel import Touch
from leo_sim.effects.base import Ground
from leo_sim.engines.planar import jacobian, POSE, poses, rows, tree_of
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
        self._stiffness = _each(robot.contacts, 'stiffness', ground.stiffness)
        self._damping = _each(robot.contacts, 'damping', ground.damping)
        self._friction = np.asarray(ground.friction, dtype=float)[..., None]
        self._surfaces: dict[tuple[int, ...], tuple[Any, Any, Any, Any]] = {}

    def touch(self, q: Any, dq: Any, shape: tuple[int, ...]) -> Touch:
        """The spheres at true angles and rates (..., J), for states of leading axes `shape`."""
        size, points = q.shape[-1], len(self._links)
        angles, rates = rows(q, shape, size, True), rows(dq, shape, size, True)
        surface = self._surface(shape)
        over, bend = np.empty((len(angles), points)), np.empty((len(angles), points, 2))
        normal, tangent = np.empty((2, len(angles), points, size))
        _over(self._tree, self._links, self._places, surface[0], angles, rates, over, bend,
              normal, tangent)
        return Touch(over, bend, normal, tangent, angles, *surface[1:])

    def _surface(self, shape: tuple[int, ...]) -> tuple[Any, Any, Any, Any]:
        """Slope, stiffness, damping and friction as rows, kept for the shape asked last."""
        found = self._surfaces.get(shape)
        if found is None:
            points = len(self._links)
            found = (rows(self._slope[..., None], shape, 1)[:, 0],
                     rows(self._stiffness, shape, points), rows(self._damping, shape, points),
                     rows(self._friction, shape, 1))
            self._surfaces = {shape: found}
        return found

    def forces(self, q: Any, dq: Any) -> Any:
        """Normal force on each sphere at true angles and rates (..., J), N, (..., P)."""
        shape = np.shape(q)[:-1]
        touch = self.touch(q, dq, shape)
        sinking = -np.einsum('npj,nj->np', touch.normal, rows(dq, shape, q.shape[-1], True))
        force = np.maximum(touch.damping * sinking - touch.stiffness * touch.over, 0.0)
        return np.where(touch.over < 0, force, 0.0).reshape(*shape, -1)


def _each(contacts: Sequence[Contact], name: str, of_ground: Any) -> Any:
    """A figure of every sphere: its own, or that of the ground, (..., P)."""
    figures = [of_ground if getattr(c, name) is None else getattr(c, name) for c in contacts]
    return np.stack(np.broadcast_arrays(*(np.asarray(f, dtype=float) for f in figures)), axis=-1)


@compiled_without_gil
def _over(tree: Any, links: Any, places: Any, slope: Any, q: Any, dq: Any, height: Any, bend: Any,
          normal: Any, tangent: Any) -> Any:
    """Fill height (N, P), bend (N, P, 2) and Jacobians (N, P, J) for states (N, J)."""
    size = q.shape[1]
    pose, lever = np.zeros((tree.kind.shape[0], POSE)), np.empty((3, size))
    for n in range(q.shape[0]):
        poses(tree.kind, tree.parent, tree.column, tree.turn, tree.sense, tree.place, q[n],
              dq[n], pose)
        angle = slope[n if slope.shape[0] > 1 else 0]
        up, along = np.cos(angle), np.sin(angle)
        for p in range(links.shape[0]):
            i = links[p]
            c, s = np.cos(pose[i, 0]), np.sin(pose[i, 0])
            rx = c * places[p, 0] - s * places[p, 1]
            rz = s * places[p, 0] + c * places[p, 1]
            x, z, turn = pose[i, 1] + rx, pose[i, 2] + rz, pose[i, 3]
            ax, az = pose[i, 6] - turn * turn * rx, pose[i, 7] - turn * turn * rz
            rise = up * (pose[i, 5] + turn * rx) - along * (pose[i, 4] - turn * rz)
            bend[n, p, 0] = up * az - along * ax
            bend[n, p, 1] = up * ax + along * az + turn * rise
            centre = up * z - along * x
            height[n, p] = centre - places[p, 2]
            jacobian(tree.kind, tree.parent, tree.column, tree.sense, pose, i,
                     x + along * centre, z - up * centre, lever)
            for j in range(size):
                normal[n, p, j] = up * lever[1, j] - along * lever[0, j]
                tangent[n, p, j] = up * lever[0, j] + along * lever[1, j]
