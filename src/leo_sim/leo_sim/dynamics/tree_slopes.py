# SPDX-License-Identifier: Apache-2.0
"""How the torques that a motion takes change with angles, rates and masses of a tree, compiled.

Derivatives of recursive Newton-Euler in closed form (Singh, Russell and Wensing, Efficient
Analytical Derivatives of Rigid-Body Dynamics using Spatial Vector Algebra, RA-L 2022), in the
world axes of `tree_kernel`. There the matrix 2B of a body of inertia J about the origin, first
moment h, momentum p and velocities w, u is, on a screw (a, b), (T a, -2 p x a) with
T = 2 w x J - tr(J) w x - 2 (u h' - h u 1).
"""

from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil
from leo_sim.dynamics.tree_kernel import (
    along,
    carried,
    cross,
    momentum,
    pulling,
    put,
    RESTING,
    Room,
    row,
    SCREW,
    taken_by,
    Tree,
    weighed,
    WEIGHT,
)


class Slopes(NamedTuple):
    """Room to work in, one row per link, and the slopes."""

    turn: Array  # acceleration of the link with its joints', gravity as -g upwards, (L, SCREW)
    spin: Array  # first and second derivative of its screw, the joint's own rate aside, (L, SCREW)
    swing: Array
    stir: Array  # T, row by row, and p of all that hangs on the link, (L, 12)
    force: Array  # moment and force that these take, (L, SCREW)
    weight: Array  # of other inertial figures, see `Room`, (L, WEIGHT)
    by_angle: Array  # torque at joint i by angle of joint j, N m/rad, (J, J)
    by_rate: Array  # and by its rate, N m s/rad, (J, J)
    at_rest: Array  # the first of the two where nothing moves, (J, J)


@compiled_without_gil
def slopes_for(links: int, joints: int) -> Any:
    screws, square = np.zeros((4, links, SCREW)), np.zeros((3, joints, joints))
    stir, weight = np.zeros((links, 12)), np.zeros((links, WEIGHT))
    spin, swing, force = screws[1], screws[2], screws[3]
    return Slopes(screws[0], spin, swing, stir, force, weight, square[0], square[1], square[2])


@compiled_in_place
def slopes(tree: Tree, figures: Array, room: Room, n: int, faster: Array, out: Slopes) -> Any:
    """Fill all at the state whose links are placed and moving; row n of `faster` is its ddq."""
    size = out.by_angle.shape[0]
    for j in range(size):
        for k in range(size):
            out.by_angle[j, k] = out.by_rate[j, k] = 0.0
    for i in range(tree.kind.shape[0]):
        moved_along(tree, i, room, n, faster, out)
        _stirred(i, room, out)
    for i in range(tree.kind.shape[0] - 1, -1, -1):
        if tree.column[i] >= 0:
            _joined(tree, i, room, out)
        above = tree.parent[i]
        if above >= 0:
            for k in range(12):
                out.stir[above, k] += out.stir[i, k]
            for k in range(6):
                out.force[above, k] += out.force[i, k]
        if figures[i, 10] != 0.0 or figures[i, 11] != 0.0 or figures[i, 12] != 0.0:
            _pulled_on(tree, figures, i, room, out.by_angle)


@compiled_in_place
def moved_along(tree: Tree, i: int, room: Room, n: int, faster: Array, out: Slopes) -> Any:
    """Fill the acceleration of link i, and how its screw changes with that of its parent."""
    above, turn, screw = tree.parent[i], out.turn, room.screw
    above_speed, above_turn = RESTING, (0.0, 0.0, 0.0, 0.0, 0.0, room.pull[i, 5])
    put(turn, i, row(room.pull, i))
    if above >= 0:
        for k in range(6):
            turn[i, k] += turn[above, k] - room.pull[above, k]
        above_speed, above_turn = row(room.speed, above), row(turn, above)
    if tree.column[i] < 0:
        return
    put(out.spin, i, carried(above_speed, screw, i))
    spun, turned = carried(above_speed, out.spin, i), carried(above_turn, screw, i)
    for k in range(6):
        out.swing[i, k] = spun[k] + turned[k]
        turn[i, k] += screw[i, k] * faster[n, tree.column[i]]


@compiled_in_place
def _stirred(i: int, room: Room, out: Slopes) -> Any:
    """Fill T, p and the inertial force of link i alone."""
    w, s, stir = room.weight, room.speed, out.stir
    wx, wy, wz, ux, uy, uz = row(s, i)
    hx, hy, hz = w[i, 1], w[i, 2], w[i, 3]
    xx, yy, zz, xy, xz, yz = w[i, 4], w[i, 5], w[i, 6], w[i, 7], w[i, 8], w[i, 9]
    trace, along = xx + yy + zz, 2.0 * (hx * ux + hy * uy + hz * uz)
    a, b, c = cross(wx, wy, wz, xx, xy, xz)  # columns of w x J
    d, e, f = cross(wx, wy, wz, xy, yy, yz)
    g, h, j = cross(wx, wy, wz, xz, yz, zz)
    stir[i, 0] = 2.0 * (a - ux * hx) + along
    stir[i, 1] = 2.0 * (d - ux * hy) + trace * wz
    stir[i, 2] = 2.0 * (g - ux * hz) - trace * wy
    stir[i, 3] = 2.0 * (b - uy * hx) - trace * wz
    stir[i, 4] = 2.0 * (e - uy * hy) + along
    stir[i, 5] = 2.0 * (h - uy * hz) + trace * wx
    stir[i, 6] = 2.0 * (c - uz * hx) + trace * wy
    stir[i, 7] = 2.0 * (f - uz * hy) - trace * wx
    stir[i, 8] = 2.0 * (j - uz * hz) + along
    _, _, _, stir[i, 9], stir[i, 10], stir[i, 11] = momentum(w, i, wx, wy, wz, ux, uy, uz)
    put(out.force, i, taken_by(w, i, s, out.turn, 0.0))


@compiled_in_place
def _joined(tree: Tree, i: int, room: Room, out: Slopes) -> Any:
    """Add what passes between joint i and those above it, of all that hangs on its link."""
    s, t, spin, swing, own = room.screw, out.stir, out.spin, out.swing, tree.column[i]
    sx, sy, sz, vx, vy, vz = row(s, i)
    px, py, pz = t[i, 9], t[i, 10], t[i, 11]
    felt = momentum(room.whole, i, sx, sy, sz, vx, vy, vz)
    gx, gy, gz = cross(px, py, pz, vx, vy, vz)
    rx = t[i, 0] * sx + t[i, 3] * sy + t[i, 6] * sz + 2.0 * gx
    ry = t[i, 1] * sx + t[i, 4] * sy + t[i, 7] * sz + 2.0 * gy
    rz = t[i, 2] * sx + t[i, 5] * sy + t[i, 8] * sz + 2.0 * gz
    angle, rate = _felt(room, out, i)
    j = i
    while j >= 0:
        other = tree.column[j]
        if other >= 0:
            out.by_angle[own, other] += (
                rx * spin[j, 0] + ry * spin[j, 1] + rz * spin[j, 2] + along(swing, j, felt)
            )
            out.by_rate[own, other] += rx * s[j, 0] + ry * s[j, 1] + rz * s[j, 2]
            out.by_rate[own, other] += 2.0 * along(spin, j, felt)
            if j != i:
                out.by_angle[other, own] += along(s, j, angle)
                out.by_rate[other, own] += along(s, j, rate)
        j = tree.parent[j]


@compiled_in_place
def _felt(room: Room, out: Slopes, i: int) -> Any:
    """Moment and force on the joints above for a unit of angle, and of rate, of joint i."""
    s, t, p, w, f = room.screw, out.stir, out.spin, out.swing, out.force
    a, b, c, d, e, g = momentum(room.whole, i, *row(w, i))
    j, k, m, n, o, q = momentum(room.whole, i, *row(p, i))
    px, py, pz = -2.0 * t[i, 9], -2.0 * t[i, 10], -2.0 * t[i, 11]
    sx, sy, sz, vx, vy, vz = row(s, i)
    fx, fy, fz, ux, uy, uz = row(f, i)
    ax, ay, az = cross(px, py, pz, p[i, 0], p[i, 1], p[i, 2])
    lx, ly, lz = cross(sx, sy, sz, ux, uy, uz)
    bx, by, bz = cross(px, py, pz, sx, sy, sz)
    mx, my, mz = cross(sx, sy, sz, fx, fy, fz)
    nx, ny, nz = cross(vx, vy, vz, ux, uy, uz)
    tx, ty, tz = _stirred_by(t, i, p[i, 0], p[i, 1], p[i, 2])
    rx, ry, rz = _stirred_by(t, i, sx, sy, sz)
    tx, ty, tz = a + tx + mx + nx, b + ty + my + ny, c + tz + mz + nz
    angle = tx, ty, tz, d + ax + lx, e + ay + ly, g + az + lz
    h = 2.0 * j + rx, 2.0 * k + ry, 2.0 * m + rz, 2.0 * n + bx, 2.0 * o + by, 2.0 * q + bz
    return angle, h


@compiled_in_place
def _stirred_by(t: Array, i: int, x: float, y: float, z: float) -> Any:
    """T of link i times a vector."""
    return (
        t[i, 0] * x + t[i, 1] * y + t[i, 2] * z,
        t[i, 3] * x + t[i, 4] * y + t[i, 5] * z,
        t[i, 6] * x + t[i, 7] * y + t[i, 8] * z,
    )


@compiled_in_place
def _pulled_on(tree: Tree, figures: Array, i: int, room: Room, out: Array) -> Any:
    """Add what a force on link i does, which keeps its direction as the joints above turn."""
    s, cx, cy, cz = room.screw, room.weight[i, 10], room.weight[i, 11], room.weight[i, 12]
    ex, ey, ez = figures[i, 10], figures[i, 11], figures[i, 12]
    j = i
    while j >= 0:
        if tree.column[j] >= 0:
            wx, wy, wz = s[j, 0], s[j, 1], s[j, 2]
            fx, fy, fz = cross(ex, ey, ez, wx, wy, wz)
            mx, my, mz = cross(cx, cy, cz, fx, fy, fz)
            gx, gy, gz = cross(wx, wy, wz, cx, cy, cz)
            nx, ny, nz = cross(gx + s[j, 3], gy + s[j, 4], gz + s[j, 5], ex, ey, ez)
            k, below = i, True
            while k >= 0:
                if tree.column[k] >= 0:
                    felt = (mx, my, mz, fx, fy, fz) if below else (nx, ny, nz, 0.0, 0.0, 0.0)
                    out[tree.column[k], tree.column[j]] -= along(s, k, felt)
                below = below and k != j
                k = tree.parent[k]
        j = tree.parent[j]


@compiled_in_place
def slopes_at_rest(tree: Tree, figures: Array, room: Room, none: Array, out: Slopes) -> Any:
    """Fill those by angles where the links are placed and at rest, as row 0 of `none` says."""
    slopes(tree, figures, room, 0, none, out)
    for i in range(none.shape[1]):
        for j in range(none.shape[1]):
            out.at_rest[i, j] = out.by_angle[i, j]


@compiled_in_place
def weighing(
    tree: Tree, was: Array, figures: Array, more: float, room: Room, at: Slopes, n: int, out: Array
) -> Any:
    """Fill row n of out (., J): torques that this motion takes more with other inertial figures.

    Gravity is `more` than it was.
    """
    for j in range(out.shape[1]):
        out[n, j] = 0.0
    for i in range(tree.kind.shape[0]):
        other = more != 0.0
        for k in range(figures.shape[1]):
            other = other or figures[i, k] != was[i, k]
        if other:
            weighed(figures, i, room.frame, at.weight)
            old = taken_by(room.weight, i, room.speed, at.turn, 0.0)
            new = taken_by(at.weight, i, room.speed, at.turn, more)
            before, after = pulling(room.weight, i, was), pulling(at.weight, i, figures)
            j = i
            while j >= 0:
                if tree.column[j] >= 0:
                    total = 0.0
                    for k in range(6):
                        total += room.screw[j, k] * (new[k] - after[k] - old[k] + before[k])
                    out[n, tree.column[j]] += total
                j = tree.parent[j]
