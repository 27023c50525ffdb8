# SPDX-License-Identifier: Apache-2.0
"""Rigid-body dynamics of a fixed-base tree in space, compiled: joint-space inertia and bias.

In world axes each link's centre of mass and rotation have a Jacobian with a column per joint
above it. Inertia is the sum of m Jv'Jv + Jw'I Jw, bias that of Jv'(m (a - g) - f) +
Jw'(I alpha + w x I w) with the accelerations of the links without joint accelerations.
"""
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_sim.compiled import compiled
from leo_sim.effects.base import Body
from leo_sim.engines.planar import FIXED, HINGE, KINDS, rows, SLIDE
from leo_sim.engines.stateless import Stateless
from leo_sim.urdf import Joint

Array = np.ndarray
Vec = tuple[float, float, float]
Mat = tuple[Vec, Vec, Vec]
FIGURES = 13


class Spatial(Stateless):
    """The same numbers as `leo_sim.engines.rigid.Rigid`, for several joints.

    Args:
        joints: Of the robot, parents first.
        bodies: Inertial figures by link; floats, or arrays (S, 1) that scan S values.
        gravity: m/s2; a float or an array (S, 1).
    """

    def __init__(self, joints: Sequence[Joint], bodies: Mapping[str, Body], gravity: Any):
        links = {joint.child: i for i, joint in enumerate(joints)}
        moving = [i for i, joint in enumerate(joints) if joint.kind != 'fixed']
        column = {i: c for c, i in enumerate(moving)}
        self._tree = (
            np.array([KINDS[j.kind] for j in joints]),
            np.array([links.get(j.parent, -1) for j in joints]),
            np.array([column.get(i, -1) for i in range(len(joints))]),
            np.array([j.rotation for j in joints]).reshape(-1, 3),
            np.array([j.translation for j in joints]), np.array([j.axis for j in joints]),
            np.array(_chains([links.get(j.parent, -1) for j in joints])))
        self._figures = _figures([bodies[joint.child] for joint in joints])
        self._gravity = np.asarray(gravity, dtype=float).reshape(-1)

    def mass_and_bias(self, q: Any, dq: Any) -> tuple[Any, Any]:
        """Joint-space inertia (..., J, J) and bias torques (..., J).

        Args:
            q: Angles (..., J).
            dq: Rates (..., J).
        """
        scans = max(len(self._figures), len(self._gravity))
        shape = np.broadcast_shapes(np.shape(q)[:-1], np.shape(dq)[:-1],
                                    (scans, 1) if scans > 1 else ())
        size = np.shape(q)[-1]
        states = rows(q, shape, size, True), rows(dq, shape, size, True)
        figures = np.broadcast_to(self._figures, (scans, *self._figures.shape[1:]))
        gravity = np.broadcast_to(self._gravity, scans)
        mass, bias = np.empty((len(states[0]), size, size)), np.empty((len(states[0]), size))
        _dynamics(*self._tree, figures, gravity, *states, mass, bias)
        return mass.reshape(*shape, size, size), bias.reshape(*shape, size)

    def bias(self, q: Any, dq: Any) -> Any:
        """The bias torques alone, (..., J)."""
        return self.mass_and_bias(q, dq)[1]

    def load(self, q: Any) -> Any:
        """Torque of gravity and external forces at the joints, N m, (..., J), along +q."""
        return -self.bias(q, np.zeros_like(q))


def _chains(parents: Sequence[int]) -> list[int]:
    """For each link, a bit for each joint between it and the base."""
    chains: list[int] = []
    for i, parent in enumerate(parents):
        chains.append((1 << i) | (chains[parent] if parent >= 0 else 0))
    return chains


def _figures(bodies: Sequence[Body]) -> Any:
    """Mass, CoM, inertia (xx yy zz xy xz yz) and force of each link, (S or 1, L, 13)."""
    parts = np.broadcast_arrays(*(np.asarray(x, dtype=float).reshape(-1) for b in bodies
                                  for x in (b.mass, *b.com, *b.inertia, *b.force)))
    return np.ascontiguousarray(np.stack(parts, axis=-1).reshape(-1, len(bodies), FIGURES))


@compiled
def _vector(rows: Array, i: int) -> Vec:
    return rows[i, 0], rows[i, 1], rows[i, 2]


@compiled
def _keep(rows: Array, i: int, a: Vec) -> None:
    rows[i, 0], rows[i, 1], rows[i, 2] = a


@compiled
def _plus(a: Vec, b: Vec) -> Vec:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def _times(factor: float, a: Vec) -> Vec:
    return factor * a[0], factor * a[1], factor * a[2]


@compiled
def _dot(a: Vec, b: Vec) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _cross(a: Vec, b: Vec) -> Vec:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def _turned(r: Mat, a: Vec) -> Vec:
    """Matrix (three rows) times vector."""
    return _dot(r[0], a), _dot(r[1], a), _dot(r[2], a)


@compiled
def _back(r: Mat, a: Vec) -> Vec:
    """Transposed matrix times vector."""
    return _plus(_plus(_times(a[0], r[0]), _times(a[1], r[1])), _times(a[2], r[2]))


@compiled
def _product(r: Mat, s: Mat) -> Mat:
    """Product of two matrices: each row of the first, turned by the second."""
    return _back(s, r[0]), _back(s, r[1]), _back(s, r[2])


@compiled
def _about(axis: Vec, angle: float) -> Mat:
    """Rotation matrix by an angle about an axis (Rodrigues)."""
    x, y, z = axis
    c, s = np.cos(angle), np.sin(angle)
    v = 1.0 - c
    return ((c + x * x * v, x * y * v - z * s, x * z * v + y * s),
            (y * x * v + z * s, c + y * y * v, y * z * v - x * s),
            (z * x * v - y * s, z * y * v + x * s, c + z * z * v))


@compiled
def _carried(turn: Vec, speed: Vec, lever: Vec) -> Vec:
    """Acceleration of a point at a lever: turn x lever + speed x (speed x lever)."""
    return _plus(_cross(turn, lever), _cross(speed, _cross(speed, lever)))


@compiled
def _spin(body: Array, r: Mat, a: Vec) -> Vec:
    """Rotational inertia of a link about its CoM, in world axes, times a vector."""
    b = _back(r, a)
    xx, yy, zz, xy, xz, yz = body[4], body[5], body[6], body[7], body[8], body[9]
    return _turned(r, (xx * b[0] + xy * b[1] + xz * b[2], xy * b[0] + yy * b[1] + yz * b[2],
                       xz * b[0] + yz * b[1] + zz * b[2]))


@compiled
def _add(i: int, chain: int, kind: Array, column: Array, body: Array, r: Mat, com: Vec,
         down: float, push: Vec, speed: Vec, turn: Vec, origin: Array, axis: Array, mass: Array,
         bias: Array, front: Array, swing: Array) -> None:
    """Add link i to mass (J, J) and bias (J): its chain is a bit per joint above it."""
    force = _plus(_times(body[0], push), (-body[10], -body[11], body[0] * down - body[12]))
    moment = _plus(_spin(body, r, turn), _cross(speed, _spin(body, r, speed)))
    for j in range(i + 1):
        if column[j] < 0 or not (chain >> j) & 1:
            continue
        a, c = _vector(axis, j), column[j]
        move, rate = a, (0.0, 0.0, 0.0)
        if kind[j] == HINGE:
            move, rate = _cross(a, _plus(com, _times(-1.0, _vector(origin, j)))), a
        bias[c] += _dot(move, force) + _dot(rate, moment)
        _keep(front, c, move)
        _keep(swing, c, _spin(body, r, rate))
        for k in range(j + 1):
            if column[k] < 0 or not (chain >> k) & 1:
                continue
            d = column[k]
            mass[c, d] += body[0] * _dot(move, _vector(front, d))
            if kind[k] == HINGE and kind[j] == HINGE:
                mass[c, d] += _dot(a, _vector(swing, d))


@compiled
def _dynamics(kind: Array, parent: Array, column: Array, rotation: Array, translation: Array,
              own: Array, chain: Array, figures: Array, gravity: Array, q: Array, dq: Array,
              mass: Array, bias: Array) -> None:
    """Fill mass (N, J, J) and bias (N, J) for states (N, J)."""
    count, size, each = len(kind), q.shape[1], len(q) // len(figures)
    turns = np.empty((3 * count, 3))
    origin, axis, speed, turn, push = (np.empty((count, 3)), np.empty((count, 3)),
                                       np.empty((count, 3)), np.empty((count, 3)),
                                       np.empty((count, 3)))
    front, swing = np.empty((size, 3)), np.empty((size, 3))
    mass[:], bias[:] = 0.0, 0.0
    zero = (0.0, 0.0, 0.0)
    for n in range(len(q)):
        for i in range(count):
            p, f = parent[i], _vector(translation, i)
            r = (_vector(rotation, 3 * i), _vector(rotation, 3 * i + 1),
                 _vector(rotation, 3 * i + 2))
            o, w, t, a = zero, zero, zero, zero
            if p >= 0:
                above = (_vector(turns, 3 * p), _vector(turns, 3 * p + 1),
                         _vector(turns, 3 * p + 2))
                r, f = _product(above, r), _turned(above, f)
                o, w, t, a = (_vector(origin, p), _vector(speed, p), _vector(turn, p),
                              _vector(push, p))
            z = _turned(r, _vector(own, i))
            go = dq[n, column[i]] if kind[i] != FIXED else 0.0
            drag = _times(go, _cross(w, z))
            if kind[i] == SLIDE:
                f = _plus(f, _times(q[n, column[i]], z))
                a = _plus(a, _times(2.0, drag))
            o, a = _plus(o, f), _plus(a, _carried(t, w, f))
            if kind[i] == HINGE:
                r = _product(r, _about(_vector(own, i), q[n, column[i]]))
                t, w = _plus(t, drag), _plus(w, _times(go, z))
            for k in range(3):
                _keep(turns, 3 * i + k, r[k])
            _keep(origin, i, o)
            _keep(axis, i, z)
            _keep(speed, i, w)
            _keep(turn, i, t)
            _keep(push, i, a)
            body = figures[n // each, i]
            lever = _turned(r, (body[1], body[2], body[3]))
            _add(i, chain[i], kind, column, body, r, _plus(o, lever), gravity[n // each],
                 _plus(a, _carried(t, w, lever)), w, t, origin, axis, mass[n], bias[n], front,
                 swing)
        for j in range(size):
            for k in range(j):
                mass[n, k, j] = mass[n, j, k]
