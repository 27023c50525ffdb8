# SPDX-License-Identifier: Apache-2.0
"""A robot on the ground as `contact_kernel` takes it: states, forces, what strikes next."""

from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Indices
from leo_sim.common.compiled import compiled_in_place
from leo_sim.dynamics.ground import Touch
from leo_sim.dynamics.inertia import at

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
    """What drives the joints while the geometry is held; rows of N or 1 states, J columns."""

    smooth: Array  # torque at the rates `at`, bias taken off, N m
    drag: Array  # falling of it with speed, N m s/rad
    at: Array  # rates where the torques were taken, rad/s
    rotor: Array  # inertia of the motor sides without play, kg m2
    level: Array  # largest dry friction, N m
    low: Array  # stops, rad
    high: Array


class Play(NamedTuple):
    """Motor sides behind a dead zone; rows of N or 1 states, J columns."""

    gap: Array  # width rad; 0 for a joint without play
    torque: Array  # of the motor at the rates `at`, N m
    drag: Array  # falling of it with speed, N m s/rad
    at: Array  # rates of the motor sides where the torque was taken, rad/s
    inertia: Array  # kg m2


class Work(NamedTuple):
    """One state at work: what moves it, and the impulses that may act, one row each."""

    # one entry per joint. The compiler knows how long a tuple is, and writes loops out
    axes: tuple[int, ...]
    joint: Array  # figures of the joints, (18, J), see the names of its rows below
    stiffness: Array  # of the spheres, (P,); bend (P, 2)
    damping: Array
    over: Array
    bend: Array
    kind: Indices  # which law a row is, at which joint or sphere
    place: Indices
    line: Array  # figures of the rows, (7, R), see below
    lever: Array  # what the impulse multiplies, (R, J)
    moves: Array  # rates that a unit impulse causes, (R, J)
    gram: Array  # the rate of each row (first axis) that the impulse of each (second) causes
    inverse: Array  # of inertia with drag, (J, J)
    system: Array  # matrix and right-hand side of the linear solve, (R, R + 1)
    unknown: Indices  # the row each unknown of it belongs to


# rows of Work.joint
Q, DQ, OFFSET, SPEED, SMOOTH, DRAG, AT, ROTOR, LEVEL, LOW, HIGH = range(11)
GAP_WIDTH, MOTOR, MOTOR_DRAG, MOTOR_AT, INERTIA, BEFORE, PUSH = range(11, 18)
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


@compiled_in_place
def taken(n: int, motion: Motion, forces: Forces, play: Play, touch: Touch, work: Work) -> Any:
    """Copy the figures of state n to work."""
    first = copied(n, motion, work.joint, 0)
    first = copied(n, forces, work.joint, first)
    copied(n, play, work.joint, first)
    soft, damped = at(touch.stiffness, n), at(touch.damping, n)
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
        for j in range(out.shape[1]):
            out[first, j] = values[at(values, n), j]
        first += 1
    return first


@compiled_in_place
def gathered(n: int, touch: Touch, period: float, held: int, work: Work) -> Any:
    """List the impulses that may act in the period, none given yet; returns their number."""
    joint, used, size = work.joint, 0, len(work.axes)
    for j in range(held, size):
        reach = period * (abs(joint[DQ, j]) + SUDDEN)
        near = joint[Q, j] - joint[LOW, j] < reach or joint[HIGH, j] - joint[Q, j] < reach
        dry, wide = joint[LEVEL, j] > 0.0, joint[GAP_WIDTH, j] > 0.0
        for kind, there in ((FRICTION, dry), (STOP, near), (GAP, wide)):
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
