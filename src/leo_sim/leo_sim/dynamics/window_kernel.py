# SPDX-License-Identifier: Apache-2.0
"""One state after the other through its window: compiled for `whole_windows`."""

from collections import namedtuple
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil
from leo_sim.dynamics.impulses import Contact, swept
from leo_sim.dynamics.inertia import at, inverted, kicked
from leo_sim.dynamics.substep import PROBE
from leo_sim.dynamics.tree_kernel import bias_torques, inertia, placed, Room, room_for, Tree
from leo_sim.dynamics.window_input import Bent, Driving, Looped, Play

Work = namedtuple(
    'Work',
    'q dq free mean pull held bias load falling level motor drive rotor gap slip speed none servo'
    ' h inverse given',
)
"""Room for one state: 18 rows (1, J), h (1, 1), the inverse of its inertia, impulses (3, J)."""


@compiled_without_gil
def work_of(size: int) -> Any:
    r, h, inverse = np.zeros((18, 1, size)), np.zeros((1, 1)), np.zeros((1, size, size))
    first = r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]
    second = r[9], r[10], r[11], r[12], r[13], r[14], r[15], r[16], r[17]
    return Work(*first, *second, h, inverse, np.zeros((3, size)))


@compiled_without_gil
def run(
    tree: Tree,
    figures: Array,
    gravity: Array,
    each: int,
    driving: Driving,
    play: Play,
    laws: Any,
    bent: Bent,
    behind: Any,
    looped: Looped,
    q: Array,
    dq: Array,
    begin: int,
    end: int,
) -> None:
    """Fill angles and rates (K + 1, N, J) of states from `begin` to `end` after the first sample.

    Figures of the links and gravity, m/s2, serve `each` states in a row, see `spatial.dynamics`.
    Laws are functions of three parameters, angle, rate, torque of the motor and load; behind the
    servos' loops are functions of three parameters and the voltage. Bent and looped have their
    parameters and places. The first angles and rates are given.
    """
    size = q.shape[2]
    room, work = room_for(tree.kind.shape[0]), work_of(size)
    for n in range(begin, end):
        s = (n // each) % figures.shape[0]
        own, down = figures[s], gravity[s]
        for j in range(size):
            work.q[0, j], work.dq[0, j] = q[0, n, j], dq[0, n, j]
            work.gap[0, j] = play.gap[at(play.gap, n), j]
            work.slip[0, j] = play.slip[at(play.slip, n), j]
            work.speed[0, j] = play.speed[at(play.speed, n), j]
        for k in range(driving.parts.shape[0]):
            work.h[0, 0] = step = driving.h[k, n]
            if bent.loaded and driving.first[k]:
                _loaded(tree, own, down, room, work)
            if driving.first[k]:
                _slowed(driving, laws, bent, n, k, work)
                _slowed_by_loops(looped, behind, n, k, work)
            for j in range(size):
                work.q[0, j] += 0.5 * step * work.dq[0, j]
            for _ in range(driving.parts[k]):
                placed(tree, own, 0, work.q, room)
                if bent.loaded:
                    bias_torques(tree, own, down, 0, work.none, room, work.load)
                _looped(looped, behind, n, k, work)
                _pulled(driving, laws, bent, n, k, work)
                _kick(tree, own, down, driving, n, k, room, work)
            for j in range(size):
                work.q[0, j] -= 0.5 * step * work.dq[0, j]
                q[k + 1, n, j], dq[k + 1, n, j] = work.q[0, j], work.dq[0, j]


@compiled_in_place
def _loaded(tree: Tree, figures: Array, gravity: float, room: Room, work: Work) -> Any:
    """Fill the bias of a joint at rest, which is the load with the other sign."""
    placed(tree, figures, 0, work.q, room)
    bias_torques(tree, figures, gravity, 0, work.none, room, work.load)


@compiled_in_place
def _slowed(driving: Driving, laws: Any, bent: Bent, n: int, k: int, work: Work) -> Any:
    """Fill how the smooth torques fall with the rates, once per sample period."""
    for j in range(work.q.shape[1]):
        q, dq, load = work.q[0, j], work.dq[0, j], -work.load[0, j]
        work.falling[0, j] = driving.falling[k, n, j]
        for b in range(bent.dry.shape[0]):
            if bent.acts[b, j] and not bent.dry[b]:
                a, e, f = bent.values[b, n, 0], bent.values[b, n, 1], bent.values[b, n, 2]
                here = laws[b](a, e, f, q, dq, 0.0, load)
                there = laws[b](a, e, f, q, dq + PROBE, 0.0, load)
                work.falling[0, j] += (here - there) / PROBE


@compiled_in_place
def _pulled(driving: Driving, laws: Any, bent: Bent, n: int, k: int, work: Work) -> Any:
    """Fill the driving torques, with dry friction and without, and its level."""
    row = at(driving.level, n)
    for j in range(work.q.shape[1]):
        q, dq, load = work.q[0, j], work.dq[0, j], -work.load[0, j]
        pull = driving.torque[k, n, j] - driving.falling[k, n, j] * dq + work.servo[0, j]
        level, motor = driving.level[row, j], 0.0
        if bent.loaded or work.gap[0, j] > 0.0:
            speed = work.speed[0, j] if work.gap[0, j] > 0.0 else dq
            motor = driving.motor[k, n, j] - driving.motor_falling[k, n, j] * speed
            motor += work.servo[0, j]
        if work.gap[0, j] > 0.0:
            pull -= driving.motor[k, n, j] - driving.motor_falling[k, n, j] * dq
        for b in range(bent.dry.shape[0]):
            if bent.acts[b, j]:
                a, e, f = bent.values[b, n, 0], bent.values[b, n, 1], bent.values[b, n, 2]
                torque = laws[b](a, e, f, q, dq, motor, load)
                if bent.dry[b]:
                    level += abs(torque)
                else:
                    pull += torque
        work.pull[0, j], work.level[0, j], work.drive[0, j] = pull, level, motor
        work.held[0, j] = pull - np.sign(dq) * level


@compiled_in_place
def _looped(looped: Looped, behind: Any, n: int, k: int, work: Work) -> Any:
    """Fill the torques that the servos' loops ask for."""
    for j in range(work.q.shape[1] if looped.goal.shape[0] else 0):
        work.servo[0, j] = _answered(looped, behind, n, k, j, work.q[0, j], work.dq[0, j])


@compiled_in_place
def _slowed_by_loops(looped: Looped, behind: Any, n: int, k: int, work: Work) -> Any:
    """Add how these fall with the rates."""
    for j in range(work.q.shape[1] if looped.goal.shape[0] else 0):
        q, dq = work.q[0, j], work.dq[0, j]
        here = _answered(looped, behind, n, k, j, q, dq)
        there = _answered(looped, behind, n, k, j, q, dq + PROBE)
        work.falling[0, j] += (here - there) / PROBE


@compiled_in_place
def _answered(looped: Looped, behind: Any, n: int, k: int, j: int, q: float, dq: float) -> Any:
    """The torque of one motor, N m, that its loop asks for, back-EMF left out."""
    torque = looped.torque[k, n, j]
    if torque == 0.0:
        return 0.0
    grain = looped.grain[at(looped.grain, n), j]
    read = looped.scale[at(looped.scale, n), j] * q + looped.zero[at(looped.zero, n), j]
    error = grain * (np.rint(looped.goal[k, n, j] / grain) - np.rint(read / grain))
    duty = looped.gain[at(looped.gain, n), j] * error
    duty -= looped.rate_gain[at(looped.rate_gain, n), j] * dq
    volts = min(max(duty, -1.0), 1.0) * looped.supply[at(looped.supply, n), j]
    for b in range(looped.acts.shape[0]):
        if looped.acts[b, j]:
            volts = behind[b](
                looped.values[b, n, 0], looped.values[b, n, 1], looped.values[b, n, 2], volts
            )
    return torque * volts


@compiled_in_place
def _kick(
    tree: Tree,
    figures: Array,
    gravity: float,
    driving: Driving,
    n: int,
    k: int,
    room: Room,
    work: Work,
) -> Any:
    """Kick the rates of a state whose links are placed, and drift its angles by one substep."""
    size, step, answer = work.q.shape[1], work.h[0, 0], work.inverse[0]
    rotor = at(driving.rotor, n)
    inertia(tree, room, answer)
    for j in range(size):
        answer[j, j] += driving.rotor[rotor, j] + 0.5 * step * work.falling[0, j]
        if work.gap[0, j] > 0.0:
            falling = driving.motor_falling[k, n, j]
            work.rotor[0, j] = driving.rotor[rotor, j] + 0.5 * step * falling
            work.motor[0, j] = work.speed[0, j] + step * work.drive[0, j] / work.rotor[0, j]
            answer[j, j] -= work.rotor[0, j]
    inverted(size, 0, answer)
    bias_torques(tree, figures, gravity, 0, work.dq, room, work.bias)
    if size > 1:
        kicked(0, answer, work.held, work.bias, work.dq, 0.5 * step, work.mean)
        bias_torques(tree, figures, gravity, 0, work.mean, room, work.bias)
    kicked(0, answer, work.pull, work.bias, work.dq, step, work.free)
    for kind in range(3):
        for j in range(size):
            work.given[kind, j] = 0.0
    contact = Contact(
        work.level, driving.low, driving.high, work.gap, work.rotor, work.slip, work.q, work.dq
    )
    swept(0, work.free, work.motor, work.inverse, work.h, contact, work.given)
    for j in range(size):
        work.dq[0, j] = work.free[0, j]
        work.speed[0, j] = work.motor[0, j] if work.gap[0, j] > 0.0 else work.free[0, j]
        work.slip[0, j] += step * (work.speed[0, j] - work.free[0, j])
        work.q[0, j] += step * work.free[0, j]
