# SPDX-License-Identifier: Apache-2.0
"""The ground under a robot, and the spheres that touch it.

A sphere that is depth d in the ground and sinks at the rate v is pushed out by
max(0, stiffness d + damping v), and held against sliding by at most friction times that. Both act
where its centre stands over the ground, so that the spheres of a flat foot slide alike.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Indices, Numbers, rows
from leo_sim.common.compiled import compiled, compiled_in_place, compiled_without_gil
from leo_sim.description.robot import Contact, Robot
from leo_sim.dynamics.planar import jacobian, POSE, poses, Tree, tree_of
from leo_sim.effects.base import Ground


class Floor(NamedTuple):
    """Spheres and what is under them; rows of N or 1 states, P spheres."""

    links: Indices  # that each sphere is on, (P,)
    places: Array  # x, z and radius in the axes of that link, m, (P, 3)
    slope: Array  # rad, (.,)
    stiffness: Array  # N/m and N s/m, (., P)
    damping: Array
    friction: Array  # (., 1)


class Touch(NamedTuple):
    """Spheres over the ground; rows of N or 1 states, P spheres."""

    over: Array  # height over the ground at the angles `at`, m, (N, P)
    bend: Array  # accelerations of height and of sliding without those of the joints, (N, P, 2)
    normal: Array  # its rate and the sliding speed per joint rate, (N, P, J)
    tangent: Array
    at: Array  # angles of that geometry, (N, J)
    stiffness: Array  # N/m and N s/m, (., P)
    damping: Array
    friction: Array  # (., 1)


class Spheres:
    def __init__(self, robot: Robot, ground: Ground):
        self._tree = tree_of(robot.joints)
        links = {joint.child: i for i, joint in enumerate(robot.joints)}
        self._links = np.array([links[c.link] for c in robot.contacts])
        self._places = np.array([[c.x, c.z, c.radius] for c in robot.contacts])
        self._slope = np.asarray(ground.slope, dtype=float)
        self._stiffness = _each(robot.contacts, 'stiffness', ground.stiffness)
        self._damping = _each(robot.contacts, 'damping', ground.damping)
        self._friction = np.asarray(ground.friction, dtype=float)[..., None]
        self._floors: dict[tuple[int, ...], Floor] = {}  # of the shape asked last

    def touch(self, q: Array, dq: Array, shape: tuple[int, ...]) -> Touch:
        """The spheres at true angles and rates (..., J), for states of leading axes `shape`."""
        size = q.shape[-1]
        angles, rates = rows(q, shape, size, True), rows(dq, shape, size, True)
        touch = untouched(angles, self.floor(shape))
        touching(self._tree, self.floor(shape), rates, touch)
        return touch

    def floor(self, shape: tuple[int, ...]) -> Floor:
        found = self._floors.get(shape)
        if found is None:
            points = len(self._links)
            found = Floor(
                self._links,
                self._places,
                rows(self._slope[..., None], shape, 1)[:, 0],
                rows(self._stiffness, shape, points),
                rows(self._damping, shape, points),
                rows(self._friction, shape, 1),
            )
            self._floors = {shape: found}
        return found

    def forces(self, q: Array, dq: Array) -> Any:
        """Normal force on each sphere at true angles and rates (..., J), N, (..., P)."""
        shape = np.shape(q)[:-1]
        touch = self.touch(q, dq, shape)
        sinking = -np.einsum('npj,nj->np', touch.normal, rows(dq, shape, q.shape[-1], True))
        force = np.maximum(touch.damping * sinking - touch.stiffness * touch.over, 0.0)
        return np.where(touch.over < 0, force, 0.0).reshape(*shape, -1)


def _each(contacts: Sequence[Contact], name: str, of_ground: Numbers) -> Any:
    """A figure of every sphere: its own, or that of the ground, (..., P)."""
    figures = [of_ground if getattr(c, name) is None else getattr(c, name) for c in contacts]
    return np.stack(np.broadcast_arrays(*(np.asarray(f, dtype=float) for f in figures)), axis=-1)


@compiled
def untouched(q: Array, floor: Floor) -> Any:
    """A `Touch` to be filled, for states (N, J)."""
    states, points, size = q.shape[0], floor.links.shape[0], q.shape[1]
    return Touch(
        np.empty((states, points)),
        np.empty((states, points, 2)),
        np.empty((states, points, size)),
        np.empty((states, points, size)),
        q,
        floor.stiffness,
        floor.damping,
        floor.friction,
    )


@compiled_without_gil
def touching(tree: Tree, floor: Floor, dq: Array, touch: Touch) -> Any:
    """Fill the geometry of a `Touch` at its angles and the rates (N, J)."""
    q, size = touch.at, touch.at.shape[1]
    pose, lever = np.zeros((tree.kind.shape[0], POSE)), np.empty((3, size))
    for n in range(q.shape[0]):
        poses(tree, n, q, dq, pose)
        touched(tree, floor, n, pose, lever, touch)


@compiled_in_place
def touched(tree: Tree, floor: Floor, n: int, pose: Array, lever: Array, touch: Touch) -> Any:
    """Fill row n of a `Touch` from the poses of the links; lever (3, J) is room to work in."""
    angle = floor.slope[n if floor.slope.shape[0] > 1 else 0]
    up, along = np.cos(angle), np.sin(angle)
    for p in range(floor.links.shape[0]):
        i = floor.links[p]
        c, s = pose[i, 10], pose[i, 11]
        rx = c * floor.places[p, 0] - s * floor.places[p, 1]
        rz = s * floor.places[p, 0] + c * floor.places[p, 1]
        x, z, turn = pose[i, 1] + rx, pose[i, 2] + rz, pose[i, 3]
        ax, az = pose[i, 6] - turn * turn * rx, pose[i, 7] - turn * turn * rz
        rise = up * (pose[i, 5] + turn * rx) - along * (pose[i, 4] - turn * rz)
        touch.bend[n, p, 0] = up * az - along * ax
        touch.bend[n, p, 1] = up * ax + along * az + turn * rise
        centre = up * z - along * x
        touch.over[n, p] = centre - floor.places[p, 2]
        jacobian(tree, pose, i, x + along * centre, z - up * centre, lever)
        for j in range(lever.shape[1]):
            touch.normal[n, p, j] = up * lever[1, j] - along * lever[0, j]
            touch.tangent[n, p, j] = up * lever[0, j] + along * lever[1, j]
