# SPDX-License-Identifier: Apache-2.0
"""Compiled substeps of a robot on the ground, between two evaluations of its geometry.

Per substep h: drift by h/2, kick, drift by h/2, with inertia, bias and contact Jacobians held.
Motor drag, contact dampers, dry friction, stops and play are solved together, see
`contact_impulses`. A substep in which something strikes (a sphere the ground, a
joint its stop, a gear the end of its play) is cut there.
"""

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Indices
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil
from leo_sim.dynamics import contact_work as row
from leo_sim.dynamics.contact_impulses import agreed, share, swept
from leo_sim.dynamics.contact_work import (
    along,
    Forces,
    gathered,
    Motion,
    next_strike,
    Play,
    sunk,
    taken,
    Work,
)
from leo_sim.dynamics.ground import Floor, Touch, touched, untouched
from leo_sim.dynamics.inertia import at, inverted
from leo_sim.dynamics.tree_kernel import bias_torques, inertia, placed, room_for, Tree

SWEEPS = 60
SOLVES = 20  # of them with a linear solve behind
SETTLED = 1e-9  # m/s, rad/s
SHORTEST = 1 / 32  # of a substep


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
    """Move states in place by `count` substeps of h s, (N or 1,).

    Mass is the joint-space inertia, (N, J, J); the first `held` joints, (N or 1,), do not move.
    Adds the normal and tangential impulse of each sphere to `impulses`, N s, (N, P, 2). Axes is a
    tuple with one entry per joint, see `Work`.
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
        longest, grip = h[at(h, n)], touch.friction[at(touch.friction, n), 0]
        taken(n, motion, forces, play, touch, work)
        still = held[at(held, n)]
        used = gathered(n, touch, longest * count, still, work)
        run(n, mass, longest, count, still, grip, work, used, impulses)
        for j in range(size):
            motion.q[n, j], motion.dq[n, j] = work.joint[row.Q, j], work.joint[row.DQ, j]
            motion.offset[n, j] = work.joint[row.OFFSET, j]
            motion.speed[n, j] = work.joint[row.SPEED, j]


@compiled_without_gil
def advance_periods(
    motion: Motion,
    last: Array,
    tree: Tree,
    figures: Array,
    gravity: Array,
    each: int,
    floor: Floor,
    forces: Forces,
    play: Play,
    h: Array,
    inner: int,
    count: int,
    held: Indices,
    axes: tuple[int, ...],
) -> Any:
    """Move states in place by `count` periods of `inner` substeps of h s, as `advance` does.

    In one call, under laws that stay the same: the bias is not yet taken off the forces. Last are
    the rates one period before, (N, J), and after. For figures and gravity see `spatial.dynamics`.
    """
    states, size = motion.q.shape
    middle, ahead = np.empty((states, size)), np.empty((states, size))
    mass, bias = np.empty((states, size, size)), np.empty((states, size))
    touch = untouched(middle, floor)
    room = room_for(tree.kind.shape[0])
    impulses = np.zeros((*touch.over.shape, 2))
    for _ in range(count):
        for n in range(states):
            half = 0.5 * inner * h[at(h, n)]
            for j in range(size):
                middle[n, j] = motion.q[n, j] + half * motion.dq[n, j]
                ahead[n, j] = 1.5 * motion.dq[n, j] - 0.5 * last[n, j]
                last[n, j] = motion.dq[n, j]
            s = (n // each) % figures.shape[0]
            own, down = figures[s], gravity[s]
            placed(tree, own, n, middle, room)
            inertia(tree, room, mass[n])
            bias_torques(tree, own, down, n, ahead, room, bias)
            touched(tree, floor, n, room, down, touch)
        driven = Forces(forces.smooth - bias, *forces[1:])
        advance(motion, mass, driven, play, touch, h, inner, held, impulses, axes)
        _linked(motion, play)


@compiled_without_gil
def _linked(motion: Motion, play: Play) -> Any:
    """Motor sides without play turn as their joints do."""
    for n in range(motion.q.shape[0]):
        gap = play.gap[at(play.gap, n)]
        for j in range(motion.q.shape[1]):
            if gap[j] <= 0.0:
                motion.speed[n, j] = motion.dq[n, j]


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
            if work.kind[r] >= row.NORMAL:
                impulses[n, work.place[r], work.kind[r] - row.NORMAL] += work.line[row.GIVEN, r]
        left -= current


@compiled_in_place
def factorised(n: int, mass: Array, h: float, held: int, work: Work, used: int) -> Any:
    """Fill inverse, moves and gram for substeps of h s."""
    size = len(work.axes)
    for i in range(size):
        for j in range(size):
            work.inverse[i, j] = mass[n, i, j]
        work.inverse[i, i] += work.joint[row.ROTOR, i] + 0.5 * h * work.joint[row.DRAG, i]
    inverted(len(work.axes), held, work.inverse)
    for r in range(used):
        if work.kind[r] < row.NORMAL:  # at one joint, its lever is 1 there
            for i in range(size):
                work.moves[r, i] = work.inverse[work.place[r], i]
        else:
            for i in range(size):
                work.moves[r, i] = along(work.axes, work.inverse, i, work.lever, r)
        for k in range(r + 1):
            work.gram[r, k] = work.gram[k, r] = (
                work.moves[r, work.place[k]]
                if work.kind[k] < row.NORMAL
                else along(work.axes, work.lever, k, work.moves, r)
            )


@compiled_in_place
def substep(t: float, h: float, held: int, grip: float, work: Work, used: int) -> Any:
    """Drift, kick and drift by h s, from t s after the middle of the period."""
    joint = work.joint
    size = len(work.axes)
    sunk(t, h, grip, work, used)
    for j in range(held, size):
        joint[row.BEFORE, j] = joint[row.DQ, j]
        joint[row.Q, j] += 0.5 * h * joint[row.DQ, j]
    pushed(t + h, h, held, work, used)
    for sweep in range(SWEEPS if used else 0):
        if sweep < SOLVES:
            agreed(h, grip, work, used)
        if swept(h, grip, work, used) <= SETTLED:
            break
    for r in range(used):
        given = work.line[row.GIVEN, r]
        if given != 0.0:
            for j in range(held, size):
                joint[row.DQ, j] += work.moves[r, j] * given
    for j in range(held, size):
        joint[row.Q, j] += 0.5 * h * joint[row.DQ, j]
        if joint[row.GAP_WIDTH, j] > 0.0:
            joint[row.OFFSET, j] += h * (joint[row.SPEED, j] - joint[row.DQ, j])


@compiled_in_place
def pushed(t: float, h: float, held: int, work: Work, used: int) -> Any:
    """Rates after the smooth torques, and those of the rows with the impulses given before."""
    joint, line = work.joint, work.line
    size = len(work.axes)
    for j in range(size):
        fall = joint[row.DRAG, j] * (joint[row.DQ, j] - joint[row.AT, j])
        joint[row.PUSH, j] = h * (joint[row.SMOOTH, j] - fall) if j >= held else 0.0
    for j in range(held, size):
        joint[row.DQ, j] += along(work.axes, work.inverse, j, joint, row.PUSH)
    for r in range(used):
        caused = 0.0
        for k in range(used):
            caused += work.gram[r, k] * line[row.GIVEN, k]
        line[row.RATE, r] = along(work.axes, work.lever, r, joint, row.DQ) + caused
        if work.kind[r] >= row.NORMAL:
            line[row.RATE, r] += work.bend[work.place[r], work.kind[r] - row.NORMAL] * t
        if work.kind[r] == row.GAP:
            j = work.place[r]
            fall = joint[row.MOTOR_DRAG, j] * (joint[row.SPEED, j] - joint[row.MOTOR_AT, j])
            left = h * (joint[row.MOTOR, j] - fall) - line[row.GIVEN, r]
            joint[row.SPEED, j] += left * share(h, work, j)
