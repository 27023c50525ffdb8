# SPDX-License-Identifier: Apache-2.0
"""The ground under a robot, and the spheres that touch it.

A sphere that is depth d in the ground and sinks at the rate v is pushed out by
max(0, stiffness d + damping v), and held against sliding by at most friction times that. Both act
where its centre stands over the ground, so that the spheres of a flat foot slide alike.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.broadcasting import Array, Indices, Numbers, rows
from leo_sim.common.compiled import compiled, compiled_in_place, compiled_without_gil
from leo_sim.description.joint import Joint
from leo_sim.description.robot import Contact, Robot
from leo_sim.dynamics.inertia import at
from leo_sim.dynamics.spatial import tree_of
from leo_sim.dynamics.tree_kernel import (
    FIGURES,
    HINGE,
    KINDS,
    moving,
    placed,
    Room,
    room_for,
    SLIDE,
    Tree,
)
from leo_sim.effects.base import Ground

FLAT = 1e-9


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
        for joint in robot.joints:
            _check(joint)
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


def _check(joint: Joint) -> None:
    turned = abs(joint.rotation[4] - 1.0) < FLAT
    hinge = KINDS[joint.kind] != HINGE or abs(abs(joint.axis[1]) - 1.0) < FLAT
    slide = KINDS[joint.kind] != SLIDE or abs(joint.axis[1]) < FLAT
    if not (turned and hinge and slide):
        raise UserError(
            f'joint {joint.name!r} leaves the x-z plane: a robot with a ground has '
            'hinges along y and slides along x and z only'
        )


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
    links = tree.kind.shape[0]
    room, weightless = room_for(links), np.zeros((links, FIGURES))
    for n in range(dq.shape[0]):
        placed(tree, weightless, n, touch.at, room)
        moving(tree, weightless, 0.0, n, dq, room)
        touched(tree, floor, n, room, 0.0, touch)


@compiled_in_place
def touched(tree: Tree, floor: Floor, n: int, room: Room, gravity: float, touch: Touch) -> Any:
    """Fill row n of a `Touch` from links that are placed and moving under gravity, m/s2."""
    angle = floor.slope[at(floor.slope, n)]
    up, along = np.cos(angle), np.sin(angle)
    frame, speed, pull = room.frame, room.speed, room.pull
    for p in range(floor.links.shape[0]):
        i, px, pz = floor.links[p], floor.places[p, 0], floor.places[p, 1]
        x = frame[i, 9] + frame[i, 0] * px + frame[i, 2] * pz
        z = frame[i, 11] + frame[i, 6] * px + frame[i, 8] * pz
        turn = speed[i, 1]
        vx, vz = speed[i, 3] + turn * z, speed[i, 5] - turn * x
        ax, az = pull[i, 3] + turn * vz, pull[i, 5] - gravity - turn * vx
        touch.bend[n, p, 0] = up * az - along * ax
        touch.bend[n, p, 1] = up * ax + along * az - turn * (up * vz - along * vx)
        centre = up * z - along * x
        touch.over[n, p] = centre - floor.places[p, 2]
        x, z = x + along * centre, z - up * centre
        for j in range(touch.at.shape[1]):
            touch.normal[n, p, j] = touch.tangent[n, p, j] = 0.0
        while i >= 0:
            j = tree.column[i]
            if j >= 0:
                vx = room.screw[i, 3] + room.screw[i, 1] * z
                vz = room.screw[i, 5] - room.screw[i, 1] * x
                touch.normal[n, p, j] += up * vz - along * vx
                touch.tangent[n, p, j] += up * vx + along * vz
            i = tree.parent[i]
