# SPDX-License-Identifier: Apache-2.0
"""Rigid-body dynamics of a tree in the x-z plane, compiled: inertia, bias, points on links.

Each link's centre of mass has a Jacobian with one column per joint above it; inertia is the sum
of m J'J + I w'w, bias that of m J'(acceleration without joint accelerations - g) less external
forces. Angles count from x towards z, about -y.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.broadcasting import Array, common, Indices, rows
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil
from leo_sim.description.joint import columns
from leo_sim.description.urdf import Body, Joint
from leo_sim.dynamics.inertia import Compiled

FIXED, HINGE, SLIDE = 0, 1, 2
KINDS = {'fixed': FIXED, 'revolute': HINGE, 'continuous': HINGE, 'prismatic': SLIDE}
FLAT, POSE = 1e-9, 12
MASS, COM_X, COM_Z, INERTIA, FORCE_X, FORCE_Z = range(6)


class Tree(NamedTuple):
    """Geometry of a planar tree, one entry per joint and its child link."""

    kind: Indices  # FIXED, HINGE or SLIDE, (L,)
    parent: Indices  # index of the parent link, -1 for the world, (L,)
    column: Indices  # index in the state, -1 for a fixed joint, (L,)
    turn: Array  # angle of the joint frame in the parent link, rad, (L,)
    sense: Array  # +1 for a hinge about -y, -1 about +y, (L,)
    # joint origin in the parent link and slide direction in the joint frame, x and z each, (L, 4)
    place: Array


class World(NamedTuple):
    """What the links weigh; rows of N or 1 states."""

    figures: Array  # mass, CoM, inertia and external force of each link, (., L, 6)
    gravity: Array  # m/s2, (.,)


class Planar(Compiled):
    """Dynamics of a planar tree over any leading axes.

    Inertial figures are floats, or arrays (S, 1) that scan S values; so is gravity, m/s2.
    """

    def __init__(self, joints: Sequence[Joint], bodies: Mapping[str, Body], gravity: Any):
        self.tree = tree_of(joints)
        self.figures = _figures([bodies[joint.child] for joint in joints])
        self.gravity = np.asarray(gravity, dtype=float)
        self.leading = common(self.figures.shape[:-2], self.gravity.shape)

    def fill(self, shape: tuple[int, ...], q: Array, dq: Array, mass: Array, bias: Array) -> None:
        dynamics(self.tree, self.world(shape), q, dq, mass, bias)

    def world(self, shape: tuple[int, ...]) -> World:
        """Inertial figures and gravity for states of leading axes `shape`."""
        return World(
            rows(self.figures, shape, self.figures.shape[-2:]),
            rows(self.gravity[..., None], shape, 1)[:, 0],
        )


def tree_of(joints: Sequence[Joint]) -> Tree:
    """The planar geometry of joints; UserError: one leaves the x-z plane."""
    links = {joint.child: i for i, joint in enumerate(joints)}
    for joint in joints:
        _check(joint)
    return Tree(
        np.array([KINDS[j.kind] for j in joints]),
        np.array([links.get(j.parent, -1) for j in joints]),
        np.array(columns(joints)),
        np.array([np.arctan2(j.rotation[6], j.rotation[0]) for j in joints]),
        np.array([-j.axis[1] for j in joints]),
        np.array([[j.translation[0], j.translation[2], j.axis[0], j.axis[2]] for j in joints]),
    )


def _check(joint: Joint) -> None:
    turned = abs(joint.rotation[4] - 1.0) < FLAT
    hinge = KINDS[joint.kind] != HINGE or abs(abs(joint.axis[1]) - 1.0) < FLAT
    slide = KINDS[joint.kind] != SLIDE or abs(joint.axis[1]) < FLAT
    if not (turned and hinge and slide):
        raise UserError(
            f'joint {joint.name!r} leaves the x-z plane: a robot with a ground has '
            'hinges along y and slides along x and z only'
        )


def _figures(bodies: Sequence[Body]) -> Any:
    """Mass, CoM x z, inertia about y, force x z per link, (..., L, 6)."""
    columns = [(b.mass, b.com[0], b.com[2], b.inertia[1], b.force[0], b.force[2]) for b in bodies]
    parts = np.broadcast_arrays(*(np.asarray(x, dtype=float) for row in columns for x in row))
    return np.stack(parts, axis=-1).reshape(*parts[0].shape, len(bodies), 6)


@compiled_in_place
def poses(tree: Tree, n: int, q: Array, dq: Array, pose: Array) -> Any:
    """Fill pose (L, POSE): angle, origin, rate, velocity, acceleration, axis, cosine and sine.

    Of the links' frames in state n of (N, J); vectors as x z; cosine and sine are of the angle.
    The acceleration is that without joint accelerations, gravity as -g upwards not included.
    """
    kind, column, turn, sense, place = tree.kind, tree.column, tree.turn, tree.sense, tree.place
    for i in range(kind.shape[0]):
        above = tree.parent[i]
        angle, ox, oz, rate, vx, vz, ax, az = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        c, s = 1.0, 0.0
        if above >= 0:
            angle, ox, oz, rate = pose[above, 0], pose[above, 1], pose[above, 2], pose[above, 3]
            vx, vz, ax, az = pose[above, 4], pose[above, 5], pose[above, 6], pose[above, 7]
            c, s = pose[above, 10], pose[above, 11]
        angle += turn[i]
        rx = c * place[i, 0] - s * place[i, 1]
        rz = s * place[i, 0] + c * place[i, 1]
        if kind[i] == SLIDE:
            c, s = np.cos(angle), np.sin(angle)
            ux = c * place[i, 2] - s * place[i, 3]
            uz = s * place[i, 2] + c * place[i, 3]
            go = dq[n, column[i]]
            rx += ux * q[n, column[i]]
            rz += uz * q[n, column[i]]
            vx += ux * go
            vz += uz * go
            ax -= 2.0 * rate * uz * go
            az += 2.0 * rate * ux * go
            pose[i, 8], pose[i, 9] = ux, uz
        pose[i, 1], pose[i, 2] = ox + rx, oz + rz
        pose[i, 4], pose[i, 5] = vx - rate * rz, vz + rate * rx
        pose[i, 6], pose[i, 7] = ax - rate * rate * rx, az - rate * rate * rz
        if kind[i] == HINGE:
            angle += sense[i] * q[n, column[i]]
            rate += sense[i] * dq[n, column[i]]
        pose[i, 0], pose[i, 3] = angle, rate
        pose[i, 10], pose[i, 11] = np.cos(angle), np.sin(angle)


@compiled_in_place
def jacobian(tree: Tree, pose: Array, link: int, px: float, pz: float, out: Array) -> Any:
    """Fill out (3, J): x, z and angle rates of a point of a link per joint rate."""
    kind, column, sense = tree.kind, tree.column, tree.sense
    out[:] = 0.0
    i = link
    while i >= 0:
        j = column[i]
        if kind[i] == HINGE:
            out[0, j] = -sense[i] * (pz - pose[i, 2])
            out[1, j] = sense[i] * (px - pose[i, 1])
            out[2, j] = sense[i]
        elif kind[i] == SLIDE:
            out[0, j] = pose[i, 8]
            out[1, j] = pose[i, 9]
        i = tree.parent[i]


@compiled_without_gil
def dynamics(tree: Tree, world: World, q: Array, dq: Array, mass: Array, bias: Array) -> Any:
    """Fill bias (N, J) for states (N, J), and mass (N, J, J) unless it has no rows."""
    pose, lever = np.zeros((tree.kind.shape[0], POSE)), np.empty((3, q.shape[1]))
    for n in range(q.shape[0]):
        poses(tree, n, q, dq, pose)
        weighed(tree, world, n, pose, lever, mass, bias)


@compiled_in_place
def weighed(
    tree: Tree, world: World, n: int, pose: Array, lever: Array, mass: Array, bias: Array
) -> Any:
    """Fill row n of bias, and of mass if it has rows, from the poses of the links.

    Lever (3, J) is room to work in.
    """
    size, wanted = bias.shape[1], mass.shape[0] > 0
    f = n if world.figures.shape[0] > 1 else 0
    down = world.gravity[n if world.gravity.shape[0] > 1 else 0]
    for j in range(size):
        bias[n, j] = 0.0
        for k in range(size if wanted else 0):
            mass[n, j, k] = 0.0
    for i in range(tree.kind.shape[0]):
        weight, inertia = world.figures[f, i, MASS], world.figures[f, i, INERTIA]
        c, s = pose[i, 10], pose[i, 11]
        rx = c * world.figures[f, i, COM_X] - s * world.figures[f, i, COM_Z]
        rz = s * world.figures[f, i, COM_X] + c * world.figures[f, i, COM_Z]
        jacobian(tree, pose, i, pose[i, 1] + rx, pose[i, 2] + rz, lever)
        square = pose[i, 3] * pose[i, 3]
        fx = weight * (pose[i, 6] - square * rx) - world.figures[f, i, FORCE_X]
        fz = weight * (pose[i, 7] - square * rz + down) - world.figures[f, i, FORCE_Z]
        for j in range(size):
            x, z, w = weight * lever[0, j], weight * lever[1, j], inertia * lever[2, j]
            if x == 0.0 and z == 0.0 and w == 0.0:
                continue
            bias[n, j] += lever[0, j] * fx + lever[1, j] * fz
            for k in range(j + 1 if wanted else 0):
                mass[n, j, k] += x * lever[0, k] + z * lever[1, k] + w * lever[2, k]
    for j in range(size):
        for k in range(j if wanted else 0):
            mass[n, k, j] = mass[n, j, k]
