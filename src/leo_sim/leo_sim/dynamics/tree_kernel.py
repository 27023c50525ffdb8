# SPDX-License-Identifier: Apache-2.0
"""Equations of motion of a tree in space, compiled, for one state after the other.

All in world axes and about the origin of the world (Featherstone, Rigid Body Dynamics Algorithms,
chapters 5 and 6): a screw is an angular part and then a linear one, that of the point of the body
which is at the origin. Composite bodies give the inertia, recursive Newton-Euler the bias; what
depends on the angles alone is found once for both.
"""

from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Indices
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil

FIXED, HINGE, SLIDE = 0, 1, 2
KINDS = {'fixed': FIXED, 'revolute': HINGE, 'continuous': HINGE, 'prismatic': SLIDE}
FIGURES = 13
FRAME, WEIGHT, SCREW = 12, 13, 6
RESTING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Tree(NamedTuple):
    """Geometry of a tree, one entry per joint and its child link."""

    kind: Indices  # FIXED, HINGE or SLIDE, (L,)
    parent: Indices  # index of the parent link, -1 for the world, (L,)
    # index in the state, -1 for a fixed joint, (L,); joints that copy another share its
    column: Indices
    ratio: Array  # angle of the joint for a unit of that state, (L,); 1 but for joints that copy
    # rotation at a joint angle, (L, 3, 9): a constant part, what cosine and what sine multiply
    turning: Array
    place: Array  # joint origin in the parent link, m, (L, 3)
    axis: Array  # unit vector in the joint frame, (L, 3)


class Room(NamedTuple):
    """Room to work in, one row per link."""

    frame: Array  # rotation, row by row, and origin m, (L, FRAME)
    screw: Array  # what a unit rate of the joint's state does, (L, SCREW)
    # mass, its first moment, its inertia xx yy zz xy xz yz, and the CoM, (L, WEIGHT)
    weight: Array
    whole: Array  # the first ten of them for all that hangs on the link, (L, WEIGHT)
    speed: Array  # screw of the link, (L, SCREW)
    pull: Array  # its acceleration at zero joint accelerations, gravity as -g upwards, (L, SCREW)
    force: Array  # moment and force that this takes, (L, SCREW)


@compiled_without_gil
def room_for(links: int) -> Any:
    return Room(
        np.empty((links, FRAME)),
        np.zeros((links, SCREW)),
        np.empty((links, WEIGHT)),
        np.empty((links, WEIGHT)),
        np.empty((links, SCREW)),
        np.empty((links, SCREW)),
        np.empty((links, SCREW)),
    )


@compiled_in_place
def cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> Any:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@compiled_in_place
def row(screws: Array, i: int) -> Any:
    s = screws
    return s[i, 0], s[i, 1], s[i, 2], s[i, 3], s[i, 4], s[i, 5]


@compiled_in_place
def put(screws: Array, i: int, screw: Any) -> Any:
    for k in range(6):
        screws[i, k] = screw[k]


@compiled_in_place
def carried(moving: Any, screws: Array, i: int) -> Any:
    """A screw times row i of screws: how that changes as it is carried along."""
    wx, wy, wz, vx, vy, vz = moving
    ax, ay, az, bx, by, bz = row(screws, i)
    a, b, c = cross(wx, wy, wz, ax, ay, az)
    d, e, f = cross(wx, wy, wz, bx, by, bz)
    g, h, j = cross(vx, vy, vz, ax, ay, az)
    return a, b, c, d + g, e + h, f + j


@compiled_in_place
def along(screws: Array, i: int, felt: Any) -> Any:
    """What a moment and force do along screw i, or a screw to a moment and force there."""
    a, b, c, d, e, f = felt
    s = screws
    return s[i, 0] * a + s[i, 1] * b + s[i, 2] * c + s[i, 3] * d + s[i, 4] * e + s[i, 5] * f


@compiled_in_place
def placed(tree: Tree, figures: Array, n: int, q: Array, room: Room) -> Any:
    """Fill frame, screw and weight at the angles of state n."""
    frame, screw = room.frame, room.screw
    for i in range(tree.kind.shape[0]):
        above, kind, t = tree.parent[i], tree.kind[i], tree.turning
        c, s = 1.0, 0.0
        if kind == HINGE:
            angle = tree.ratio[i] * q[n, tree.column[i]]
            c, s = np.cos(angle), np.sin(angle)
        if above < 0:
            for k in range(9):
                frame[i, k] = t[i, 0, k] + c * t[i, 1, k] + s * t[i, 2, k]
            for k in range(3):
                frame[i, 9 + k] = tree.place[i, k]
        else:
            for k in range(3):
                x, y, z = frame[above, 3 * k], frame[above, 3 * k + 1], frame[above, 3 * k + 2]
                for j in range(3):
                    frame[i, 3 * k + j] = (
                        x * (t[i, 0, j] + c * t[i, 1, j] + s * t[i, 2, j])
                        + y * (t[i, 0, 3 + j] + c * t[i, 1, 3 + j] + s * t[i, 2, 3 + j])
                        + z * (t[i, 0, 6 + j] + c * t[i, 1, 6 + j] + s * t[i, 2, 6 + j])
                    )
                frame[i, 9 + k] = frame[above, 9 + k] + (
                    x * tree.place[i, 0] + y * tree.place[i, 1] + z * tree.place[i, 2]
                )
        if tree.column[i] >= 0:
            _screwed(tree, i, n, q, frame, screw)
        weighed(figures, i, frame, room.weight)


@compiled_in_place
def _screwed(tree: Tree, i: int, n: int, q: Array, frame: Array, screw: Array) -> Any:
    """The screw of joint i for a unit of its state; a slide moves its frame along."""
    r = tree.ratio[i]
    ax, ay, az = r * tree.axis[i, 0], r * tree.axis[i, 1], r * tree.axis[i, 2]
    x = frame[i, 0] * ax + frame[i, 1] * ay + frame[i, 2] * az
    y = frame[i, 3] * ax + frame[i, 4] * ay + frame[i, 5] * az
    z = frame[i, 6] * ax + frame[i, 7] * ay + frame[i, 8] * az
    if tree.kind[i] == SLIDE:
        go = q[n, tree.column[i]]
        frame[i, 9] += go * x
        frame[i, 10] += go * y
        frame[i, 11] += go * z
        screw[i, 3], screw[i, 4], screw[i, 5] = x, y, z
    else:
        screw[i, 0], screw[i, 1], screw[i, 2] = x, y, z
        screw[i, 3], screw[i, 4], screw[i, 5] = cross(
            frame[i, 9], frame[i, 10], frame[i, 11], x, y, z
        )


@compiled_in_place
def weighed(figures: Array, i: int, frame: Array, weight: Array) -> Any:
    """The inertial figures of link i in the world, of (L, FIGURES) in its own axes."""
    m, cx, cy, cz = figures[i, 0], figures[i, 1], figures[i, 2], figures[i, 3]
    xx, yy, zz = figures[i, 4], figures[i, 5], figures[i, 6]
    xy, xz, yz = figures[i, 7], figures[i, 8], figures[i, 9]
    for k in range(3):
        a, b, c = frame[i, 3 * k], frame[i, 3 * k + 1], frame[i, 3 * k + 2]
        weight[i, 10 + k] = frame[i, 9 + k] + a * cx + b * cy + c * cz
        u, v, w = a * xx + b * xy + c * xz, a * xy + b * yy + c * yz, a * xz + b * yz + c * zz
        weight[i, 4 + k] = u * a + v * b + w * c
        for j in range(k):  # xy is entry 7, xz 8, yz 9
            weight[i, 6 + k + j] = (
                u * frame[i, 3 * j] + v * frame[i, 3 * j + 1] + (w * frame[i, 3 * j + 2])
            )
    x, y, z = weight[i, 10], weight[i, 11], weight[i, 12]
    weight[i, 0], weight[i, 1], weight[i, 2], weight[i, 3] = m, m * x, m * y, m * z
    weight[i, 4] += m * (y * y + z * z)
    weight[i, 5] += m * (x * x + z * z)
    weight[i, 6] += m * (x * x + y * y)
    weight[i, 7] -= m * x * y
    weight[i, 8] -= m * x * z
    weight[i, 9] -= m * y * z


@compiled_in_place
def momentum(
    weight: Array, i: int, wx: float, wy: float, wz: float, vx: float, vy: float, vz: float
) -> Any:
    """Inertia of row i times a screw: moment and force."""
    m, hx, hy, hz = weight[i, 0], weight[i, 1], weight[i, 2], weight[i, 3]
    xx, yy, zz = weight[i, 4], weight[i, 5], weight[i, 6]
    xy, xz, yz = weight[i, 7], weight[i, 8], weight[i, 9]
    return (
        xx * wx + xy * wy + xz * wz + (hy * vz - hz * vy),
        xy * wx + yy * wy + yz * wz + (hz * vx - hx * vz),
        xz * wx + yz * wy + zz * wz + (hx * vy - hy * vx),
        m * vx - (hy * wz - hz * wy),
        m * vy - (hz * wx - hx * wz),
        m * vz - (hx * wy - hy * wx),
    )


@compiled_in_place
def inertia(tree: Tree, room: Room, mass: Array) -> Any:
    """Fill mass (J, J) by composite rigid bodies."""
    screw, whole = room.screw, room.whole
    for j in range(mass.shape[0]):
        for k in range(mass.shape[0]):
            mass[j, k] = 0.0
    for i in range(tree.kind.shape[0]):
        for k in range(10):
            whole[i, k] = room.weight[i, k]
    for i in range(tree.kind.shape[0] - 1, -1, -1):
        if tree.column[i] >= 0:
            _answered(tree, i, screw, whole, mass)
        above = tree.parent[i]
        if above >= 0:
            for k in range(10):
                whole[above, k] += whole[i, k]


@compiled_in_place
def _answered(tree: Tree, i: int, screw: Array, whole: Array, mass: Array) -> Any:
    """Add to mass at joint i and those above it what these feel of a unit acceleration of it."""
    own, j = tree.column[i], i
    felt = momentum(whole, i, *row(screw, i))
    while j >= 0:
        other = tree.column[j]
        if other >= 0:
            entry = along(screw, j, felt)
            mass[own, other] += entry
            if j != i:
                mass[other, own] += entry
        j = tree.parent[j]


@compiled_in_place
def moving(tree: Tree, figures: Array, gravity: float, n: int, dq: Array, room: Room) -> Any:
    """Fill speed, pull and force at the rates of state n."""
    screw, speed, pull, force = room.screw, room.speed, room.pull, room.force
    for i in range(tree.kind.shape[0]):
        above = tree.parent[i]
        above_speed, above_pull = RESTING, (0.0, 0.0, 0.0, 0.0, 0.0, gravity)
        if above >= 0:
            above_speed, above_pull = row(speed, above), row(pull, above)
        put(speed, i, above_speed)
        put(pull, i, above_pull)
        if tree.column[i] >= 0:
            go, turned = dq[n, tree.column[i]], carried(above_speed, screw, i)
            for k in range(6):
                speed[i, k] += go * screw[i, k]
                pull[i, k] += go * turned[k]
        taken = taken_by(room.weight, i, speed, pull, 0.0)
        away = pulling(room.weight, i, figures)
        for k in range(6):
            force[i, k] = taken[k] - away[k]


@compiled_in_place
def taken_by(weight: Array, i: int, speed: Array, turn: Array, more: float) -> Any:
    """Moment and force that link i takes at a speed and acceleration, gravity being `more`."""
    wx, wy, wz, vx, vy, vz = row(speed, i)
    tx, ty, tz, px, py, pz = row(turn, i)
    a, b, c, d, e, f = momentum(weight, i, wx, wy, wz, vx, vy, vz)
    g, h, j, k, m, o = momentum(weight, i, tx, ty, tz, px, py, pz + more)
    return (
        g + (wy * c - wz * b) + (vy * f - vz * e),
        h + (wz * a - wx * c) + (vz * d - vx * f),
        j + (wx * b - wy * a) + (vx * e - vy * d),
        k + (wy * f - wz * e),
        m + (wz * d - wx * f),
        o + (wx * e - wy * d),
    )


@compiled_in_place
def pulling(weight: Array, i: int, figures: Array) -> Any:
    """Moment and force of the external force on link i, at its centre of mass."""
    x, y, z = figures[i, 10], figures[i, 11], figures[i, 12]
    lx, ly, lz = cross(weight[i, 10], weight[i, 11], weight[i, 12], x, y, z)
    return lx, ly, lz, x, y, z


@compiled_in_place
def bias_torques(
    tree: Tree, figures: Array, gravity: float, n: int, dq: Array, room: Room, bias: Array
) -> Any:
    """Fill row n of bias at the rates of state n, by recursive Newton-Euler."""
    screw, force = room.screw, room.force
    moving(tree, figures, gravity, n, dq, room)
    for j in range(bias.shape[1]):
        bias[n, j] = 0.0
    for i in range(tree.kind.shape[0] - 1, -1, -1):
        above, own = tree.parent[i], tree.column[i]
        if own >= 0:
            bias[n, own] += along(screw, i, row(force, i))
        if above >= 0:
            for k in range(6):
                force[above, k] += force[i, k]
