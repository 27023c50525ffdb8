# SPDX-License-Identifier: Apache-2.0
"""Compiled substeps of a robot on the ground, between two evaluations of its geometry.

Per substep h: drift by h/2, kick, drift by h/2, with inertia, bias and contact Jacobians held.
Motor drag, contact dampers, dry friction, stops and play are solved together by sweeping over
their impulses (Moreau), each exact for its row, until all agree. A substep in which something
strikes (a sphere the ground, a joint its stop, a gear the end of its play) is cut there.
"""
from typing import Any, NamedTuple

from numba import njit
import numpy as np

SWEEPS = 100
SETTLED = 1e-11  # m/s, rad/s
SHORTEST = 1 / 32  # of a substep
STRIKING = 1e-3  # m/s, rad/s; slower impacts are not worth a cut
SUDDEN = 20.0  # rad/s and m/s that a period may add to a rate
FRICTION, STOP, GAP, NORMAL, TANGENT = range(5)


class Motion(NamedTuple):
    """States (N, J): angles, rates, offset and rates of the motor sides behind play."""

    q: Any
    dq: Any
    offset: Any
    speed: Any


class Forces(NamedTuple):
    """What drives the joints while the geometry is held; rows of N or 1 states, J columns.

    Attributes:
        smooth: Torque at the rates `at`, bias taken off, N m.
        drag: Falling of it with speed, N m s/rad.
        rotor: Inertia of the motor sides without play, kg m2.
        level: Largest dry friction, N m.
        at: Rates where the torques were taken, rad/s.
        low, high: Stops, rad, (J,).
    """

    smooth: Any
    drag: Any
    rotor: Any
    level: Any
    at: Any
    low: Any
    high: Any


class Play(NamedTuple):
    """Motor sides behind a dead zone; rows of N or 1 states, J columns.

    Attributes:
        gap: Width rad; 0 for a joint without play.
        torque: Of the motor at the rates `at`, N m.
        drag: Falling of it with speed, N m s/rad.
        inertia: kg m2.
        at: Rates of the motor sides where the torque was taken, rad/s.
    """

    gap: Any
    torque: Any
    drag: Any
    inertia: Any
    at: Any


class Touch(NamedTuple):
    """Spheres over the ground; rows of N or 1 states, P spheres.

    Attributes:
        over: Height over the ground at the angles `at`, m, (N, P).
        normal, tangent: Its rate and the sliding speed per joint rate, (N, P, J).
        at: Angles of that geometry, (N, J).
        stiffness, damping: N/m and N s/m, (., P).
        friction: (., 1).
    """

    over: Any
    normal: Any
    tangent: Any
    at: Any
    stiffness: Any
    damping: Any
    friction: Any


class Rows(NamedTuple):
    """The impulses that may act on one state, one row each, and the inertia they act on.

    Attributes:
        kind, place: Which law, at which joint or sphere.
        lever: What the impulse multiplies, of spheres, (., J).
        moves: Rates that a unit impulse causes, (., J).
        answer: The rate of its own row that it causes.
        cross: The sliding speed that a sphere's normal impulse causes.
        given: Impulse, N s or N m s.
        first: Rate of the row at the start of the substep, of spheres.
        time, depth: How long a sphere is in the ground, s, and its mean height without damping.
        late: Weight of the rate after the substep in a sphere's damper.
        inverse: Of inertia with drag, (J, J).
        work: Two matrices (2, J, J) to compute it in.
        before, push: Rates and impulses of the substep, (J,).
    """

    kind: Any
    place: Any
    lever: Any
    moves: Any
    answer: Any
    cross: Any
    given: Any
    first: Any
    time: Any
    depth: Any
    late: Any
    inverse: Any
    work: Any
    before: Any
    push: Any


@njit(cache=True)
def row(values, n):  # type: ignore[no-untyped-def]
    """Row n of an array with one row per state, or one for all."""
    return values[n if values.shape[0] > 1 else 0]


@njit(cache=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """Scalar product."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@njit(cache=True)
def advance(motion, mass, forces, play, touch, h, count, held,  # type: ignore[no-untyped-def]
            impulses):
    """Move states in place by `count` substeps of h s.

    Args:
        motion: Before, and after.
        mass: Joint-space inertia, (N, J, J).
        forces, play, touch: As above.
        h: s, (N or 1,).
        count: Substeps.
        held: How many joints, the first ones, do not move.
        impulses: Filled: normal and tangential impulse of each sphere, N s, (N, P, 2).
    """
    size, points = motion.q.shape[1], touch.over.shape[1]
    most = 3 * size + 2 * points
    rows = Rows(np.empty(most, np.int64), np.empty(most, np.int64), np.empty((most, size)),
                np.empty((most, size)), np.empty(most), np.empty(most), np.empty(most),
                np.empty(most),
                np.empty(most), np.empty(most), np.empty(most), np.empty((size, size)),
                np.empty((2, size, size)), np.empty(size), np.empty(size))
    for n in range(motion.q.shape[0]):
        longest = row(h, n)
        left = longest * count
        used = gathered(n, motion, forces, play, touch, left, held, rows)
        current = 0.0
        while left > 1e-9 * longest:
            step = left / max(1.0, np.ceil(left / longest - 1e-6))
            soon = next_strike(n, motion, forces, play, touch, rows, used)
            if soon < step:
                step = max(soon, min(SHORTEST * longest, step))
            if abs(step - current) > 1e-9 * longest:
                factorised(n, mass, forces, step, held, rows, used)
                current = step
            substep(n, motion, forces, play, touch, current, held, rows, used, impulses)
            left -= current


@njit(cache=True)
def gathered(n, motion, forces, play, touch, period, held,  # type: ignore[no-untyped-def]
             rows):
    """List the impulses that may act in the period, none given yet; returns their number."""
    q, dq, size, used = motion.q[n], motion.dq[n], motion.q.shape[1], 0
    level, gap = row(forces.level, n), row(play.gap, n)
    for j in range(held, size):
        reach = period * (abs(dq[j]) + SUDDEN)
        near = q[j] - forces.low[j] < reach or forces.high[j] - q[j] < reach
        for kind, there in ((FRICTION, level[j] > 0.0), (STOP, near), (GAP, gap[j] > 0.0)):
            if there:
                rows.kind[used], rows.place[used], rows.given[used] = kind, j, 0.0
                used += 1
    for p in range(touch.over.shape[1]):
        fall = dot(touch.normal[n, p], dq)
        if height(n, p, q, touch) > period * (abs(fall) + 0.1 * SUDDEN):
            continue
        for kind in (NORMAL, TANGENT):
            rows.kind[used], rows.place[used], rows.given[used] = kind, p, 0.0
            rows.lever[used] = touch.normal[n, p] if kind == NORMAL else touch.tangent[n, p]
            used += 1
    return used


@njit(cache=True)
def height(n, p, q, touch):  # type: ignore[no-untyped-def]
    """Height of sphere p over the ground at the angles q, m."""
    total = touch.over[n, p]
    for j in range(q.shape[0]):
        total += touch.normal[n, p, j] * (q[j] - touch.at[n, j])
    return total


@njit(cache=True)
def next_strike(n, motion, forces, play, touch, rows, used):  # type: ignore[no-untyped-def]
    """Time to the next impact at the present rates, s; infinite without one."""
    q, dq, soon = motion.q[n], motion.dq[n], np.inf
    for r in range(used):
        kind, j = rows.kind[r], rows.place[r]
        if kind == NORMAL:
            over, fall = height(n, j, q, touch), -dot(rows.lever[r], dq)
            if over > 0.0 and fall > STRIKING:
                soon = min(soon, over / fall)
        elif kind == STOP:
            if abs(dq[j]) > STRIKING:
                way = forces.high[j] - q[j] if dq[j] > 0.0 else q[j] - forces.low[j]
                soon = min(soon, max(way, 0.0) / abs(dq[j]))
        elif kind == GAP:
            slip = motion.speed[n, j] - dq[j]
            if abs(slip) > STRIKING:
                half = 0.5 * row(play.gap, n)[j]
                way = half - motion.offset[n, j] if slip > 0.0 else half + motion.offset[n, j]
                soon = min(soon, max(way, 0.0) / abs(slip))
    return soon


@njit(cache=True)
def factorised(n, mass, forces, h, held, rows, used):  # type: ignore[no-untyped-def]
    """Fill inverse, moves and answers for substeps of h s."""
    size = mass.shape[1]
    rotor, drag = row(forces.rotor, n), row(forces.drag, n)
    rows.work[0] = mass[n]
    for j in range(size):
        rows.work[0, j, j] += rotor[j] + 0.5 * h * drag[j]
    inverted(rows.work[0], held, rows.work[1], rows.inverse)
    for r in range(used):
        j = rows.place[r]
        if rows.kind[r] < NORMAL:
            rows.moves[r], rows.answer[r] = rows.inverse[j], rows.inverse[j, j]
        else:
            for i in range(size):
                rows.moves[r, i] = dot(rows.inverse[i], rows.lever[r])
            rows.answer[r] = dot(rows.lever[r], rows.moves[r])
        if rows.kind[r] == NORMAL:
            rows.cross[r] = dot(rows.lever[r + 1], rows.moves[r])


@njit(cache=True)
def inverted(matrix, held, lower, out):  # type: ignore[no-untyped-def]
    """Fill out with the inverse of a positive definite matrix, zero for the first `held`."""
    size = matrix.shape[0]
    for i in range(held, size):
        for j in range(held, i + 1):
            total = matrix[i, j]
            for k in range(held, j):
                total -= lower[i, k] * lower[j, k]
            lower[i, j] = np.sqrt(total) if i == j else total / lower[j, j]
    out[:] = 0.0
    for j in range(held, size):
        for i in range(j, size):
            total = 1.0 if i == j else 0.0
            for k in range(j, i):
                total -= lower[i, k] * out[k, j]
            out[i, j] = total / lower[i, i]
    for j in range(held, size):
        for i in range(size - 1, j - 1, -1):
            total = out[i, j]
            for k in range(i + 1, size):
                total -= lower[k, i] * out[k, j]
            out[i, j] = total / lower[i, i]
            out[j, i] = out[i, j]


@njit(cache=True)
def substep(n, motion, forces, play, touch, h, held, rows, used,  # type: ignore[no-untyped-def]
            impulses):
    """Drift, kick and drift one state by h s."""
    q, dq, size = motion.q[n], motion.dq[n], motion.q.shape[1]
    rows.before[:] = dq
    sunk(n, q, dq, touch, h, rows, used)
    for j in range(held, size):
        q[j] += 0.5 * h * dq[j]
    pushed(n, motion, forces, play, h, held, rows, used)
    for _ in range(SWEEPS):
        if swept(n, motion, forces, play, touch, h, rows, used) <= SETTLED:
            break
    for j in range(held, size):
        q[j] += 0.5 * h * dq[j]
    for r in range(used):
        kind, j = rows.kind[r], rows.place[r]
        if kind == GAP:
            motion.offset[n, j] += h * (motion.speed[n, j] - dq[j])
        elif kind >= NORMAL:
            impulses[n, j, kind - NORMAL] += rows.given[r]


@njit(cache=True)
def sunk(n, q, dq, touch, h, rows, used):  # type: ignore[no-untyped-def]
    """Fill how long the spheres are in the ground in this substep, and how high on average."""
    damping, grip = row(touch.damping, n), row(touch.friction, n)[0]
    for r in range(used):
        if rows.kind[r] == NORMAL:
            over, rate = height(n, rows.place[r], q, touch), dot(rows.lever[r], dq)
            time = h
            if over > 0.0:
                time = max(0.0, h + over / rate) if rate < 0.0 else 0.0
                over = 0.0
            rows.first[r], rows.time[r], rows.depth[r] = rate, time, over + 0.5 * time * rate
            slip = dot(rows.lever[r + 1], dq)
            answer = rows.answer[r]
            if abs(slip) > STRIKING:
                answer = max(answer, answer - np.sign(slip) * grip * rows.cross[r])
            rows.late[r] = lateness(time * damping[rows.place[r]] * answer)


@njit(cache=True)
def lateness(stiffness):  # type: ignore[no-untyped-def]
    """Weight of the last rate that makes a step of a decaying rate exact: 1/2 to 1."""
    if stiffness < 1e-3:
        return 0.5
    return 1.0 / (1.0 - np.exp(-stiffness)) - 1.0 / stiffness


@njit(cache=True)
def pushed(n, motion, forces, play, h, held, rows, used):  # type: ignore[no-untyped-def]
    """Rates after the smooth torques and the impulses of the substep before."""
    dq, speed, size = motion.dq[n], motion.speed[n], motion.q.shape[1]
    smooth, drag, at = row(forces.smooth, n), row(forces.drag, n), row(forces.at, n)
    for j in range(size):
        rows.push[j] = h * (smooth[j] - drag[j] * (dq[j] - at[j])) if j >= held else 0.0
    for j in range(held, size):
        dq[j] += dot(rows.inverse[j], rows.push)
    torque, slope, rest = row(play.torque, n), row(play.drag, n), row(play.at, n)
    for r in range(used):
        for j in range(size):
            dq[j] += rows.moves[r, j] * rows.given[r]
        if rows.kind[r] == GAP:
            j = rows.place[r]
            free = h * (torque[j] - slope[j] * (speed[j] - rest[j])) - rows.given[r]
            speed[j] += free / (row(play.inertia, n)[j] + 0.5 * h * slope[j])


@njit(cache=True)
def swept(n, motion, forces, play, touch, h, rows, used):  # type: ignore[no-untyped-def]
    """Correct every impulse once; returns the largest change of a rate."""
    q, dq, moved = motion.q[n], motion.dq[n], 0.0
    for r in range(used):
        kind, j, answer, given = rows.kind[r], rows.place[r], rows.answer[r], rows.given[r]
        if kind == TANGENT:
            continue
        if kind == NORMAL:
            total, sideways = pressed(row(touch.stiffness, n)[j], row(touch.damping, n)[j],
                                      row(touch.friction, n)[0], dq, rows, r)
            moved = max(moved, changed(dq, rows, r + 1, sideways))
        elif kind == GAP:
            share = 1.0 / (row(play.inertia, n)[j] + 0.5 * h * row(play.drag, n)[j])
            slip = motion.speed[n, j] - dq[j] + (share + answer) * given
            half, offset = 0.5 * row(play.gap, n)[j], motion.offset[n, j]
            kept = min(max(slip, (-half - offset) / h), (half - offset) / h)
            total = (slip - kept) / (share + answer)
            motion.speed[n, j] -= (total - given) * share
        else:
            free = dq[j] - answer * given
            if kind == FRICTION:
                kept = slowed(rows.before[j], free, row(forces.level, n)[j] * h * answer)
            else:
                kept = min(max(free, min(forces.low[j] - q[j], 0.0) / h),
                           max(forces.high[j] - q[j], 0.0) / h)
            total = (kept - free) / answer
        moved = max(moved, changed(dq, rows, r, total))
    return moved


@njit(cache=True)
def changed(dq, rows, r, total):  # type: ignore[no-untyped-def]
    """Give row r another impulse; returns the change of its rate."""
    change = total - rows.given[r]
    if change == 0.0:
        return 0.0
    rows.given[r] = total
    for i in range(dq.shape[0]):
        dq[i] += rows.moves[r, i] * change
    return abs(change * rows.answer[r])


@njit(cache=True)
def pressed(stiffness, damping, grip, dq, rows, r):  # type: ignore[no-untyped-def]
    """Normal and tangential impulse of a sphere: it sticks, slides or leaves the ground."""
    up, cross, along = rows.answer[r], rows.cross[r], rows.answer[r + 1]
    rise = dot(rows.lever[r], dq) - up * rows.given[r] - cross * rows.given[r + 1]
    slip = dot(rows.lever[r + 1], dq) - cross * rows.given[r] - along * rows.given[r + 1]
    late = rows.late[r]
    spring = -stiffness * rows.depth[r] - damping * (1.0 - late) * rows.first[r]
    time, damper = rows.time[r], damping * late * rows.time[r]
    normal = (time * spring - damper * (rise - cross * slip / along)) / (
        1.0 + damper * (up - cross * cross / along))
    tangent = -(slip + cross * normal) / along
    if normal > 0.0 and abs(tangent) <= grip * normal:
        return normal, tangent
    side = np.sign(tangent) if normal > 0.0 else -np.sign(slip)
    normal = max(0.0, time * spring - damper * rise) / max(
        1e-3, 1.0 + damper * (up + side * grip * cross))
    return normal, side * grip * normal


@njit(cache=True)
def slowed(before, free, reach):  # type: ignore[no-untyped-def]
    """Rate after dry friction, exact for a constant driving torque; see impulses.py."""
    if before == 0.0:
        return free - min(max(free, -reach), reach)
    side = 1.0 if before > 0.0 else -1.0
    against, rest = (before - free) * side, before * side
    if against + reach > rest:
        left = 1.0 - rest / (against + reach)
        return -left * max(against - reach, 0.0) * side
    return free - reach * side
