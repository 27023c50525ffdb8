# SPDX-License-Identifier: Apache-2.0
"""Compiled substeps of a robot on the ground, between two evaluations of its geometry.

Per substep h: drift by h/2, kick, drift by h/2, with inertia, bias and contact Jacobians held.
Motor drag, contact dampers, dry friction, stops and play are solved together: sweeps over their
impulses (Moreau), each exact for its row, find what holds, sticks and slides, and a linear solve
in between brings all into agreement. A substep in which something strikes (a sphere the ground, a
joint its stop, a gear the end of its play) is cut there.
"""

from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Indices
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil
from leo_sim.dynamics.inertia_inverse import inverted

SWEEPS = 60
SOLVES = 20  # of them with a linear solve behind
REDUNDANT = 1e-11  # share of a row's own answer that parts rows saying the same
SETTLED = 1e-9  # m/s, rad/s
SHORTEST = 1 / 32  # of a substep
STRIKING = 1e-3  # m/s, rad/s; slower impacts are not worth a cut
SUDDEN = 20.0  # rad/s and m/s that a period may add to a rate
FRICTION, STOP, GAP, NORMAL, TANGENT = range(5)


class Motion(NamedTuple):
    """States (N, J): angles, rates, offset and rates of the motor sides behind play."""

    q: Array
    dq: Array
    offset: Array
    speed: Array


class Forces(NamedTuple):
    """What drives the joints while the geometry is held; rows of N or 1 states, J columns.

    Attributes:
        smooth: Torque at the rates `at`, bias taken off, N m.
        drag: Falling of it with speed, N m s/rad.
        at: Rates where the torques were taken, rad/s.
        rotor: Inertia of the motor sides without play, kg m2.
        level: Largest dry friction, N m.
        low, high: Stops, rad.
    """

    smooth: Array
    drag: Array
    at: Array
    rotor: Array
    level: Array
    low: Array
    high: Array


class Play(NamedTuple):
    """Motor sides behind a dead zone; rows of N or 1 states, J columns.

    Attributes:
        gap: Width rad; 0 for a joint without play.
        torque: Of the motor at the rates `at`, N m.
        drag: Falling of it with speed, N m s/rad.
        at: Rates of the motor sides where the torque was taken, rad/s.
        inertia: kg m2.
    """

    gap: Array
    torque: Array
    drag: Array
    at: Array
    inertia: Array


class Touch(NamedTuple):
    """Spheres over the ground; rows of N or 1 states, P spheres.

    Attributes:
        over: Height over the ground at the angles `at`, m, (N, P).
        bend: Accelerations of height and of sliding without those of the joints, (N, P, 2).
        normal, tangent: Its rate and the sliding speed per joint rate, (N, P, J).
        at: Angles of that geometry, (N, J).
        stiffness, damping: N/m and N s/m, (., P).
        friction: (., 1).
    """

    over: Array
    bend: Array
    normal: Array
    tangent: Array
    at: Array
    stiffness: Array
    damping: Array
    friction: Array


class Work(NamedTuple):
    """One state at work: what moves it, and the impulses that may act, one row each.

    Attributes:
        axes: One entry per joint. The compiler knows how long a tuple is, and writes loops out.
        joint: Figures of the joints, (18, J), see the names of its rows below.
        stiffness, damping, over, bend: Of the spheres, (P,); bend (P, 2).
        kind, place: Which law a row is, at which joint or sphere.
        line: Figures of the rows, (7, R), see below.
        lever: What the impulse multiplies, (R, J).
        moves: Rates that a unit impulse causes, (R, J).
        gram: The rate of each row (first axis) that the impulse of each (second) causes.
        inverse: Of inertia with drag, (J, J).
        system: Matrix and right-hand side of the linear solve, (R, R + 1).
        unknown: The row each unknown of it belongs to.
    """

    axes: tuple[int, ...]
    joint: Array
    stiffness: Array
    damping: Array
    over: Array
    bend: Array
    kind: Indices
    place: Indices
    line: Array
    lever: Array
    moves: Array
    gram: Array
    inverse: Array
    system: Array
    unknown: Indices


# rows of Work.joint
(
    Q,
    DQ,
    OFFSET,
    SPEED,
    SMOOTH,
    DRAG,
    AT,
    ROTOR,
    LEVEL,
    LOW,
    HIGH,
    GAP_WIDTH,
    MOTOR,
    MOTOR_DRAG,
    MOTOR_AT,
    INERTIA,
    BEFORE,
    PUSH,
) = range(18)
# rows of Work.line: impulse, rate now and at the start of the substep; of spheres, their height at
# the start, how long they are in the ground, their mean height without damping, the weight of the
# last rate in the damper
GIVEN, RATE, FIRST, OVER, TIME, DEPTH, LATE = range(7)


@compiled_in_place
def along(axes: tuple[int, ...], matrix: Array, r: int, vector: Array, v: int) -> Any:
    """Scalar product of row r of a matrix with row v of another, four sums side by side."""
    size, a, b, c, d = len(axes), 0.0, 0.0, 0.0, 0.0
    for i in range(0, size - 3, 4):
        a += matrix[r, i] * vector[v, i]
        b += matrix[r, i + 1] * vector[v, i + 1]
        c += matrix[r, i + 2] * vector[v, i + 2]
        d += matrix[r, i + 3] * vector[v, i + 3]
    for i in range(size - size % 4, size):
        a += matrix[r, i] * vector[v, i]
    return (a + b) + (c + d)


@compiled_without_gil
def advance(
    motion: Motion,
    mass: Array,
    forces: Forces,
    play: Play,
    touch: Touch,
    h: Array,
    count: int,
    held: Indices,
    impulses: Array,
    axes: tuple[int, ...],
) -> Any:
    """Move states in place by `count` substeps of h s.

    Args:
        motion: Before, and after.
        mass: Joint-space inertia, (N, J, J).
        forces: What drives the joints.
        play: Motor sides behind a dead zone.
        touch: Spheres over the ground.
        h: s, (N or 1,).
        count: Substeps.
        held: How many joints, the first ones, do not move, (N or 1,).
        impulses: Filled: normal and tangential impulse of each sphere, N s, (N, P, 2).
        axes: A tuple with one entry per joint, see `Work`.
    """
    size, points = len(axes), touch.over.shape[1]
    most = 3 * size + 2 * points
    work = Work(
        axes,
        np.empty((18, size)),
        np.empty(points),
        np.empty(points),
        np.empty(points),
        np.empty((points, 2)),
        np.empty(most, np.int64),
        np.empty(most, np.int64),
        np.zeros((7, most)),
        np.empty((most, size)),
        np.empty((most, size)),
        np.empty((most, most)),
        np.empty((size, size)),
        np.empty((most, most + 1)),
        np.empty(most, np.int64),
    )
    for n in range(motion.q.shape[0]):
        longest = h[n if h.shape[0] > 1 else 0]
        grip = touch.friction[n if touch.friction.shape[0] > 1 else 0, 0]
        taken(n, motion, forces, play, touch, work)
        still = held[n if held.shape[0] > 1 else 0]
        used = gathered(n, touch, longest * count, still, work)
        run(n, mass, longest, count, still, grip, work, used, impulses)
        for j in range(size):
            motion.q[n, j], motion.dq[n, j] = work.joint[Q, j], work.joint[DQ, j]
            motion.offset[n, j], motion.speed[n, j] = work.joint[OFFSET, j], work.joint[SPEED, j]


@compiled_in_place
def run(
    n: int,
    mass: Array,
    longest: float,
    count: int,
    held: int,
    grip: float,
    work: Work,
    used: int,
    impulses: Array,
) -> Any:
    """The substeps of one state, cut where something strikes."""
    left, current = longest * count, 0.0
    middle = 0.5 * left
    while left > 1e-9 * longest:
        step = left / max(1.0, np.ceil(left / longest - 1e-6))
        soon = next_strike(middle - left, work, used)
        if soon < step:
            step = max(soon, min(SHORTEST * longest, step))
        if abs(step - current) > 1e-9 * longest:
            factorised(n, mass, step, held, work, used)
            current = step
        substep(middle - left, current, held, grip, work, used)
        for r in range(used):
            if work.kind[r] >= NORMAL:
                impulses[n, work.place[r], work.kind[r] - NORMAL] += work.line[GIVEN, r]
        left -= current


@compiled_in_place
def taken(n: int, motion: Motion, forces: Forces, play: Play, touch: Touch, work: Work) -> Any:
    """Copy the figures of state n to work."""
    first = copied(n, motion, work.joint, 0)
    first = copied(n, forces, work.joint, first)
    copied(n, play, work.joint, first)
    soft = n if touch.stiffness.shape[0] > 1 else 0
    damped = n if touch.damping.shape[0] > 1 else 0
    for p in range(touch.over.shape[1]):
        work.stiffness[p], work.damping[p] = touch.stiffness[soft, p], touch.damping[damped, p]
        work.over[p] = touch.over[n, p]
        work.bend[p, 0], work.bend[p, 1] = touch.bend[n, p, 0], touch.bend[n, p, 1]
        for j in range(touch.at.shape[1]):
            work.over[p] -= touch.normal[n, p, j] * touch.at[n, j]


@compiled_in_place
def copied(n: int, part: tuple[Array, ...], out: Array, first: int) -> Any:
    """Copy row n of each array of a tuple to the rows of out from `first` on; returns the next."""
    for values in part:
        row = n if values.shape[0] > 1 else 0
        for j in range(out.shape[1]):
            out[first, j] = values[row, j]
        first += 1
    return first


@compiled_in_place
def gathered(n: int, touch: Touch, period: float, held: int, work: Work) -> Any:
    """List the impulses that may act in the period, none given yet; returns their number."""
    joint, used, size = work.joint, 0, len(work.axes)
    for j in range(held, size):
        reach = period * (abs(joint[DQ, j]) + SUDDEN)
        near = joint[Q, j] - joint[LOW, j] < reach or joint[HIGH, j] - joint[Q, j] < reach
        for kind, there in (
            (FRICTION, joint[LEVEL, j] > 0.0),
            (STOP, near),
            (GAP, joint[GAP_WIDTH, j] > 0.0),
        ):
            if there:
                work.kind[used], work.place[used], work.line[GIVEN, used] = kind, j, 0.0
                for k in range(size):
                    work.lever[used, k] = 1.0 if k == j else 0.0
                used += 1
    for p in range(touch.over.shape[1]):
        height, fall = work.over[p], 0.0
        for j in range(size):
            height += touch.normal[n, p, j] * joint[Q, j]
            fall -= touch.normal[n, p, j] * joint[DQ, j]
        if height > period * (abs(fall) + 0.1 * SUDDEN):
            continue
        for kind in (NORMAL, TANGENT):
            work.kind[used], work.place[used], work.line[GIVEN, used] = kind, p, 0.0
            for j in range(size):
                work.lever[used, j] = (
                    touch.normal[n, p, j] if kind == NORMAL else touch.tangent[n, p, j]
                )
            used += 1
    return used


@compiled_in_place
def height(t: float, work: Work, r: int) -> Any:
    """Height of the sphere of the normal row r and its rate, t s after the middle."""
    p = work.place[r]
    over = along(work.axes, work.lever, r, work.joint, Q)
    rate = along(work.axes, work.lever, r, work.joint, DQ)
    return (work.over[p] + over + 0.5 * work.bend[p, 0] * t * t, rate + work.bend[p, 0] * t)


@compiled_in_place
def next_strike(t: float, work: Work, used: int) -> Any:
    """Time to the next impact at the present rates, s; infinite without one.

    T is the time since the middle of the period, s. Fills heights of spheres and their rates.
    """
    joint, line, soon = work.joint, work.line, np.inf
    for r in range(used):
        kind, j = work.kind[r], work.place[r]
        if kind == NORMAL:
            over, rate = height(t, work, r)
            line[OVER, r], line[FIRST, r] = over, rate
            if rate < -STRIKING and over > 0.0:
                soon = min(soon, -over / rate)
        elif kind == STOP:
            rate = joint[DQ, j]
            if abs(rate) > STRIKING:
                way = joint[HIGH, j] - joint[Q, j] if rate > 0.0 else joint[Q, j] - joint[LOW, j]
                soon = min(soon, max(way, 0.0) / abs(rate))
        elif kind == GAP:
            slip = joint[SPEED, j] - joint[DQ, j]
            if abs(slip) > STRIKING:
                way = 0.5 * joint[GAP_WIDTH, j] - np.sign(slip) * joint[OFFSET, j]
                soon = min(soon, max(way, 0.0) / abs(slip))
    return soon


@compiled_in_place
def factorised(n: int, mass: Array, h: float, held: int, work: Work, used: int) -> Any:
    """Fill inverse, moves and gram for substeps of h s."""
    size = len(work.axes)
    for i in range(size):
        for j in range(size):
            work.inverse[i, j] = mass[n, i, j]
        work.inverse[i, i] += work.joint[ROTOR, i] + 0.5 * h * work.joint[DRAG, i]
    inverted(len(work.axes), held, work.inverse)
    for r in range(used):
        if work.kind[r] < NORMAL:  # at one joint, its lever is 1 there
            for i in range(size):
                work.moves[r, i] = work.inverse[work.place[r], i]
        else:
            for i in range(size):
                work.moves[r, i] = along(work.axes, work.inverse, i, work.lever, r)
        for k in range(r + 1):
            work.gram[r, k] = work.gram[k, r] = (
                work.moves[r, work.place[k]]
                if work.kind[k] < NORMAL
                else along(work.axes, work.lever, k, work.moves, r)
            )


@compiled_in_place
def substep(t: float, h: float, held: int, grip: float, work: Work, used: int) -> Any:
    """Drift, kick and drift by h s, from t s after the middle of the period."""
    joint = work.joint
    size = len(work.axes)
    sunk(t, h, grip, work, used)
    for j in range(held, size):
        joint[BEFORE, j] = joint[DQ, j]
        joint[Q, j] += 0.5 * h * joint[DQ, j]
    pushed(t + h, h, held, work, used)
    for sweep in range(SWEEPS if used else 0):
        if sweep < SOLVES:
            agreed(h, grip, work, used)
        if swept(h, grip, work, used) <= SETTLED:
            break
    for r in range(used):
        given = work.line[GIVEN, r]
        if given != 0.0:
            for j in range(held, size):
                joint[DQ, j] += work.moves[r, j] * given
    for j in range(held, size):
        joint[Q, j] += 0.5 * h * joint[DQ, j]
        if joint[GAP_WIDTH, j] > 0.0:
            joint[OFFSET, j] += h * (joint[SPEED, j] - joint[DQ, j])


@compiled_in_place
def sunk(t: float, h: float, grip: float, work: Work, used: int) -> Any:
    """Fill how long the spheres are in the ground in this substep, and how high on average."""
    joint, line = work.joint, work.line
    for r in range(used):
        if work.kind[r] == NORMAL:
            j = work.place[r]
            over, rate, time = line[OVER, r], line[FIRST, r], h
            if over > 0.0:
                time = max(0.0, h + over / rate) if rate < 0.0 else 0.0
                over = 0.0
            line[TIME, r], line[DEPTH, r], line[LATE, r] = time, over + 0.5 * time * rate, 0.5
            if time == 0.0:
                continue
            slip = along(work.axes, work.lever, r + 1, joint, DQ) + work.bend[j, 1] * t
            answer = work.gram[r, r]
            if abs(slip) > STRIKING:
                answer = max(answer, answer - np.sign(slip) * grip * work.gram[r, r + 1])
            line[LATE, r] = lateness(time * work.damping[j] * answer)


@compiled_in_place
def lateness(stiffness: float) -> Any:
    """Weight of the last rate that makes a step of a decaying rate exact: 1/2 to 1."""
    if stiffness < 1e-3:
        return 0.5
    return 1.0 / (1.0 - np.exp(-stiffness)) - 1.0 / stiffness


@compiled_in_place
def pushed(t: float, h: float, held: int, work: Work, used: int) -> Any:
    """Rates after the smooth torques, and those of the rows with the impulses given before."""
    joint, line = work.joint, work.line
    size = len(work.axes)
    for j in range(size):
        fall = joint[DRAG, j] * (joint[DQ, j] - joint[AT, j])
        joint[PUSH, j] = h * (joint[SMOOTH, j] - fall) if j >= held else 0.0
    for j in range(held, size):
        joint[DQ, j] += along(work.axes, work.inverse, j, joint, PUSH)
    for r in range(used):
        caused = 0.0
        for k in range(used):
            caused += work.gram[r, k] * line[GIVEN, k]
        line[RATE, r] = along(work.axes, work.lever, r, joint, DQ) + caused
        if work.kind[r] >= NORMAL:
            line[RATE, r] += work.bend[work.place[r], work.kind[r] - NORMAL] * t
        if work.kind[r] == GAP:
            j = work.place[r]
            fall = joint[MOTOR_DRAG, j] * (joint[SPEED, j] - joint[MOTOR_AT, j])
            joint[SPEED, j] += (h * (joint[MOTOR, j] - fall) - line[GIVEN, r]) * share(h, work, j)


@compiled_in_place
def share(h: float, work: Work, j: int) -> Any:
    """Rate of the motor side of joint j that a unit impulse causes."""
    return 1.0 / (work.joint[INERTIA, j] + 0.5 * h * work.joint[MOTOR_DRAG, j])


@compiled_in_place
def swept(h: float, grip: float, work: Work, used: int) -> Any:
    """Correct every impulse once; returns the largest change of a rate."""
    joint, line, moved = work.joint, work.line, 0.0
    for r in range(used):
        kind, j, answer, given = work.kind[r], work.place[r], work.gram[r, r], line[GIVEN, r]
        if kind == TANGENT:
            continue
        if kind == NORMAL:
            total, sideways = pressed(grip, work, r)
            moved = max(moved, changed(work, used, r + 1, sideways))
        elif kind == GAP:
            motor = share(h, work, j)
            slip = joint[SPEED, j] - line[RATE, r] + (motor + answer) * given
            half, offset = 0.5 * joint[GAP_WIDTH, j], joint[OFFSET, j]
            kept = min(max(slip, (-half - offset) / h), (half - offset) / h)
            total = (slip - kept) / (motor + answer)
            joint[SPEED, j] -= (total - given) * motor
        else:
            free = line[RATE, r] - answer * given
            if kind == FRICTION:
                kept = slowed(joint[BEFORE, j], free, joint[LEVEL, j] * h * answer)
            else:
                kept = min(
                    max(free, min(joint[LOW, j] - joint[Q, j], 0.0) / h),
                    max(joint[HIGH, j] - joint[Q, j], 0.0) / h,
                )
            total = (kept - free) / answer
        moved = max(moved, changed(work, used, r, total))
    return moved


@compiled_in_place
def changed(work: Work, used: int, r: int, total: float) -> Any:
    """Give row r another impulse; returns the change of its rate."""
    change = total - work.line[GIVEN, r]
    if change == 0.0:
        return 0.0
    work.line[GIVEN, r] = total
    for k in range(used):
        work.line[RATE, k] += work.gram[r, k] * change
    return abs(change * work.gram[r, r])


@compiled_in_place
def pressed(grip: float, work: Work, r: int) -> Any:
    """Normal and tangential impulse of a sphere: it sticks, slides or leaves the ground."""
    line, up, cross, side = (
        work.line,
        work.gram[r, r],
        work.gram[r, r + 1],
        work.gram[r + 1, r + 1],
    )
    rise = line[RATE, r] - up * line[GIVEN, r] - cross * line[GIVEN, r + 1]
    slip = line[RATE, r + 1] - cross * line[GIVEN, r] - side * line[GIVEN, r + 1]
    spring, damper = yielding(work, r)
    normal = (spring - damper * (rise - cross * slip / side)) / (
        1.0 + damper * (up - cross * cross / side)
    )
    tangent = -(slip + cross * normal) / side
    if normal > 0.0 and abs(tangent) <= grip * normal:
        return normal, tangent
    way = np.sign(tangent) if normal > 0.0 else -np.sign(slip)
    normal = max(0.0, spring - damper * rise) / max(1e-3, 1.0 + damper * (up + way * grip * cross))
    return normal, way * grip * normal


@compiled_in_place
def yielding(work: Work, r: int) -> Any:
    """Normal impulse of a sphere at the rate 0 after the substep, and its fall with that rate."""
    line, p = work.line, work.place[r]
    early = work.damping[p] * (1.0 - line[LATE, r]) * line[FIRST, r]
    return (
        line[TIME, r] * (-work.stiffness[p] * line[DEPTH, r] - early),
        work.damping[p] * line[LATE, r] * line[TIME, r],
    )


@compiled_in_place
def agreed(h: float, grip: float, work: Work, used: int) -> Any:
    """Solve for all impulses at once, with what holds, sticks and slides as it is now."""
    a, line, count = work.system, work.line, 0
    for r in range(used):
        if holds(h, grip, work, r):
            work.unknown[count] = r
            count += 1
    for i in range(count):
        r = work.unknown[i]
        a[i, count] = -line[RATE, r]
        for k in range(count):
            c = work.unknown[k]
            a[i, k] = work.gram[r, c]
            if work.kind[c] == NORMAL and slides(grip, line, c):
                a[i, k] += np.sign(line[GIVEN, c + 1]) * grip * work.gram[r, c + 1]
            a[i, count] += a[i, k] * line[GIVEN, c]
        complete(h, work, r, i, count)
    if not solved(a, count):
        return
    for i in range(count):
        r, total = work.unknown[i], a[i, count]
        if work.kind[r] == NORMAL and slides(grip, line, r):
            changed(work, used, r + 1, np.sign(line[GIVEN, r + 1]) * grip * total)
        if work.kind[r] == GAP:
            j = work.place[r]
            work.joint[SPEED, j] -= (total - line[GIVEN, r]) * share(h, work, j)
        changed(work, used, r, total)


@compiled_in_place
def holds(h: float, grip: float, work: Work, r: int) -> Any:
    """Whether the impulse of row r is what it takes, and not at a limit of its own."""
    kind, line = work.kind[r], work.line
    if kind == FRICTION:
        most = work.joint[LEVEL, work.place[r]] * h
        return abs(line[GIVEN, r]) < 0.999999 * most and abs(line[RATE, r]) < 1e-6
    if kind == TANGENT:
        return line[GIVEN, r - 1] > 0.0 and not slides(grip, line, r - 1)
    return line[GIVEN, r] != 0.0


@compiled_in_place
def slides(grip: float, line: Array, r: int) -> Any:
    """Whether the sphere of the normal row r slides."""
    return abs(line[GIVEN, r + 1]) >= 0.999999 * grip * line[GIVEN, r]


@compiled_in_place
def complete(h: float, work: Work, r: int, i: int, count: int) -> Any:
    """Add to equation i what is particular to its row r."""
    a, kind, j, joint = work.system, work.kind[r], work.place[r], work.joint
    given = work.line[GIVEN, r]
    a[i, i] += REDUNDANT * work.gram[r, r]
    if kind == NORMAL:
        spring, damper = yielding(work, r)
        a[i, i] += 1.0 / max(damper, 1e-30)
        a[i, count] += spring / max(damper, 1e-30)
    elif kind == STOP:
        way = (
            max(joint[HIGH, j] - joint[Q, j], 0.0)
            if given < 0.0
            else min(joint[LOW, j] - joint[Q, j], 0.0)
        )
        a[i, count] += way / h
    elif kind == GAP:
        motor = share(h, work, j)
        edge = (0.5 * joint[GAP_WIDTH, j] * np.sign(given) - joint[OFFSET, j]) / h
        a[i, i] += motor
        a[i, count] += joint[SPEED, j] + motor * given - edge


@compiled_in_place
def solved(a: Array, size: int) -> Any:
    """Solve in place by elimination, the solution in column `size`; whether there is one."""
    for i in range(size):
        if abs(a[i, i]) < 1e-12:
            return False
        for k in range(i + 1, size):
            factor = a[k, i] / a[i, i]
            if factor != 0.0:
                for c in range(i + 1, size + 1):
                    a[k, c] -= factor * a[i, c]
    for i in range(size - 1, -1, -1):
        for c in range(i + 1, size):
            a[i, size] -= a[i, c] * a[c, size]
        a[i, size] /= a[i, i]
    return True


@compiled_in_place
def slowed(before: float, free: float, reach: float) -> Any:
    """Rate after dry friction, exact for a constant driving torque; see impulses.py."""
    if before == 0.0:
        return free - min(max(free, -reach), reach)
    side = 1.0 if before > 0.0 else -1.0
    against, rest = (before - free) * side, before * side
    if against + reach > rest:
        left = 1.0 - rest / (against + reach)
        return -left * max(against - reach, 0.0) * side
    return free - reach * side
