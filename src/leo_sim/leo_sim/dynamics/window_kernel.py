# SPDX-License-Identifier: Apache-2.0
"""One state after the other through its window: compiled for `whole_windows`.

Several states may go through a window side by side, the others near the first one. Then its
inertia serves them all, and what their motions take more is found with its slopes: each costs a
small part of a motion of its own. Friction, stops, play and laws answer to each as they are.
"""

from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Indices
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil
from leo_sim.dynamics.impulses import Contact, STILL, swept
from leo_sim.dynamics.inertia import at, inverted, kicked
from leo_sim.dynamics.substep import PROBE
from leo_sim.dynamics.tree_kernel import (
    bias_torques,
    inertia,
    moving,
    placed,
    Room,
    room_for,
    Tree,
)
from leo_sim.dynamics.tree_slopes import (
    moved_along,
    Slopes,
    slopes,
    slopes_at_rest,
    slopes_for,
    weighing,
)
from leo_sim.dynamics.window_input import Bent, Driving, Looped, Play

Work = namedtuple(
    'Work',
    'rows q dq free mean pull held level falling rotor faster load bias motor drive gap slip speed'
    ' none servo more h inverse back given',
)
"""Room for R states: 20 fields in rows (20, R, J), h (1, 1), the inverse of the inertia of the
first one and what the others need (2, J, J), impulses (R, 3, J)."""
KEPT = 11  # fields of the first state that the others need: the first ones, (K, J)


class World(NamedTuple):
    """The links of N states, `windows` of which are the first ones; see `run`."""

    tree: Tree
    figures: Array
    gravity: Array
    of: Indices  # number of the figures and gravity of each state of the window, (R,)
    windows: int


class Torques(NamedTuple):
    """All that pulls; see `run`."""

    driving: Driving
    laws: Any
    bent: Bent
    looped: Looped
    behind: Any


@compiled_without_gil
def work_of(count: int, size: int) -> Any:
    r, h, inverse = np.zeros((20, count, size)), np.zeros((1, 1)), np.zeros((1, size, size))
    first = r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9]
    second = r[10], r[11], r[12], r[13], r[14], r[15], r[16], r[17], r[18], r[19]
    given, back = np.zeros((count, 3, size)), np.zeros((2, size, size))
    return Work(r, *first, *second, h, inverse, back, given)


@compiled_without_gil
def run(
    tree: Tree,
    figures: Array,
    gravity: Array,
    each: int,
    own: int,
    others: int,
    kept: Array,
    known: int,
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
    """Fill angles and rates (K + 1, N, J) of windows from `begin` to `end` after the first sample.

    Figures of the links and gravity, m/s2, serve `each` states in a row, see `spatial.dynamics`;
    where there are more than `own`, each sample period has as many of its own.
    Of N = R x W states those W apart go together, R = 1 + `others`. Of the first ones what the
    others need is kept, or `known`, in (W, substeps, (KEPT + 3) J + 5 J^2), if that has rows.
    Laws are functions of three parameters, angle, rate, torque of the motor and load; behind the
    servos' loops are functions of three parameters and the voltage. Bent and looped have their
    parameters and places. The first angles and rates are given.
    """
    rows, size, links = 1 + others, q.shape[2], tree.kind.shape[0]
    windows, loads = q.shape[1] // rows, links if bent.loaded else 0
    rooms, work = (room_for(links), room_for(loads)), work_of(rows, size)
    tangents, numbers = slopes_for(links, size), np.zeros(rows, np.int64)
    world = World(tree, figures, gravity, numbers, windows)
    torques = Torques(driving, laws, bent, looped, behind)
    for w in range(begin, end):
        step = first = 0
        _begun(world, play, w, q, dq, work)
        for k in range(driving.parts.shape[0]):
            work.h[0, 0] = driving.h[k, w]
            if driving.first[k]:
                for r in range(rows):
                    world.of[r] = first + ((r * windows + w) // each) % own
                first = (first + own) % figures.shape[0]
                _sampled(world, torques, w, k, known, rooms, tangents, work)
            _drift(0.5, work)
            for _ in range(driving.parts[k]):
                if not known:
                    _lead(world, torques, w, k, others, rooms[0], tangents, work)
                if kept.shape[0]:
                    _exchanged(known, kept, w, step, work, tangents)
                if known and world.of[others] != world.of[0]:
                    _moved_again(world, w, rooms[0], tangents, work)
                for r in range(1, rows):
                    _follow(world, torques, w, k, r, rooms, tangents, work)
                    _impelled(driving, r, work)
                _moved_on(work)
                step += 1
            _drift(-0.5, work)
            _reached(w, windows, q[k + 1], dq[k + 1], work)


@compiled_in_place
def _sampled(
    world: World,
    torques: Torques,
    w: int,
    k: int,
    known: int,
    rooms: Any,
    tangents: Slopes,
    work: Work,
) -> Any:
    """Fill how the torques of all states fall with the rates, at the begin of a sample period."""
    own, bent = world.of[0], torques.bent
    if bent.loaded:
        _loaded(world, 0, rooms[0], work)
    if bent.loaded and work.q.shape[0] > 1:
        inertia(world.tree, rooms[0], work.inverse[0])
        slopes_at_rest(world.tree, world.figures[own], rooms[0], work.none, tangents)
    for r in range(known, work.q.shape[0]):
        n = r * world.windows + w
        if bent.loaded and r:
            _loaded_near(world, r, rooms[1], tangents, work)
        _slowed(torques.driving, torques.laws, bent, n, k, r, work)
        _slowed_by_loops(torques.looped, torques.behind, n, k, r, work)


@compiled_in_place
def _lead(
    world: World,
    torques: Torques,
    w: int,
    k: int,
    others: int,
    room: Room,
    tangents: Slopes,
    work: Work,
) -> Any:
    """Kick the first state of a window; where others follow, fill the slopes at its motion."""
    tree, s, loaded = world.tree, world.of[0], torques.bent.loaded
    own, down = world.figures[s], world.gravity[s]
    placed(tree, own, 0, work.q, room)
    if loaded:
        bias_torques(tree, own, down, 0, work.none, room, work.load)
    if loaded and others:
        inertia(tree, room, work.inverse[0])
        slopes_at_rest(tree, own, room, work.none, tangents)
    _driven(torques, w, k, 0, work)
    _kick(tree, own, down, torques.driving, w, room, work)
    _impelled(torques.driving, 0, work)
    if others:
        slopes(tree, own, room, 0, work.faster, tangents)
        _answers(work, tangents)


@compiled_in_place
def _reached(w: int, windows: int, q: Array, dq: Array, work: Work) -> Any:
    """Fill the rows of a window in angles and rates (N, J)."""
    for r in range(work.q.shape[0]):
        for j in range(work.q.shape[1]):
            n = r * windows + w
            q[n, j], dq[n, j] = work.q[r, j], work.dq[r, j]


@compiled_in_place
def _begun(world: World, play: Play, w: int, q: Array, dq: Array, work: Work) -> Any:
    for r in range(work.q.shape[0]):
        n = r * world.windows + w
        for j in range(work.q.shape[1]):
            work.q[r, j], work.dq[r, j] = q[0, n, j], dq[0, n, j]
            work.gap[r, j] = play.gap[at(play.gap, n), j]
            work.slip[r, j] = play.slip[at(play.slip, n), j]
            work.speed[r, j] = play.speed[at(play.speed, n), j]


@compiled_in_place
def _drift(share: float, work: Work) -> Any:
    """Move all angles by so much of a substep."""
    for r in range(work.q.shape[0]):
        for j in range(work.q.shape[1]):
            work.q[r, j] += share * work.h[0, 0] * work.dq[r, j]


@compiled_in_place
def _exchanged(known: int, kept: Array, w: int, t: int, work: Work, tangents: Slopes) -> Any:
    """Keep what the others need of the first state in a substep, or take it where it is known."""
    line = kept[w, t]
    at = _passed(known, line, 0, work.rows[:KEPT, 0])
    at = _passed(known, line, at, work.given[0])
    at = _passed(known, line, at, work.inverse[0])
    at = _passed(known, line, at, work.back[0])
    at = _passed(known, line, at, tangents.by_angle)
    at = _passed(known, line, at, tangents.by_rate)
    _passed(known, line, at, tangents.at_rest)


@compiled_in_place
def _passed(known: int, line: Array, at: int, values: Array) -> Any:
    """Numbers of a line from a place on, as values or from them, and the place after them."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            if known:
                values[i, j] = line[at]
            else:
                line[at] = values[i, j]
            at += 1
    return at


@compiled_in_place
def _moved_again(world: World, w: int, room: Room, tangents: Slopes, work: Work) -> Any:
    """Place the links of the first state, moving as they did."""
    s = world.of[0]
    placed(world.tree, world.figures[s], 0, work.q, room)
    moving(world.tree, world.figures[s], world.gravity[s], 0, work.mean, room)
    for i in range(world.tree.kind.shape[0]):
        moved_along(world.tree, i, room, 0, work.faster, tangents)


@compiled_in_place
def _loaded(world: World, r: int, room: Room, work: Work) -> Any:
    """Fill the bias of a joint at rest, which is the load with the other sign."""
    own, down = world.figures[world.of[r]], world.gravity[world.of[r]]
    placed(world.tree, own, r, work.q, room)
    bias_torques(world.tree, own, down, r, work.none, room, work.load)


@compiled_in_place
def _loaded_near(world: World, r: int, room: Room, tangents: Slopes, work: Work) -> Any:
    """Fill the load of a state near the first one; other inertial figures are not near."""
    if world.of[r] != world.of[0]:
        _loaded(world, r, room, work)
        return
    for i in range(work.q.shape[1]):
        work.load[r, i] = work.load[0, i]
        for j in range(work.q.shape[1]):
            work.load[r, i] += tangents.at_rest[i, j] * (work.q[r, j] - work.q[0, j])


@compiled_in_place
def _driven(torques: Torques, n: int, k: int, r: int, work: Work) -> Any:
    """Fill all torques of a state."""
    _looped(torques.looped, torques.behind, n, k, r, work)
    _pulled(torques.driving, torques.laws, torques.bent, n, k, r, work)
    _geared(torques.driving, n, k, r, work)


@compiled_in_place
def _slowed(driving: Driving, laws: Any, bent: Bent, n: int, k: int, r: int, work: Work) -> Any:
    """Fill how the smooth torques fall with the rates, once per sample period."""
    for j in range(work.q.shape[1]):
        q, dq, load = work.q[r, j], work.dq[r, j], -work.load[r, j]
        work.falling[r, j] = driving.falling[k, n, j]
        for b in range(bent.asked):
            if bent.acts[b, j] and not bent.dry[b]:
                a, e, f = bent.values[b, n, 0], bent.values[b, n, 1], bent.values[b, n, 2]
                here = laws[b](a, e, f, q, dq, 0.0, load)
                there = laws[b](a, e, f, q, dq + PROBE, 0.0, load)
                work.falling[r, j] += (here - there) / PROBE


@compiled_in_place
def _pulled(driving: Driving, laws: Any, bent: Bent, n: int, k: int, r: int, work: Work) -> Any:
    """Fill the driving torques, with dry friction and without, and its level."""
    states = driving.torque.shape[1]
    row = at(driving.level, n) + (k * states if driving.level.shape[0] > states else 0)
    for j in range(work.q.shape[1]):
        q, dq, load = work.q[r, j], work.dq[r, j], -work.load[r, j]
        pull = driving.torque[k, n, j] - driving.falling[k, n, j] * dq + work.servo[r, j]
        level, motor = driving.level[row, j], 0.0
        if bent.loaded or work.gap[r, j] > 0.0:
            speed = work.speed[r, j] if work.gap[r, j] > 0.0 else dq
            motor = driving.motor[k, n, j] - driving.motor_falling[k, n, j] * speed
            motor += work.servo[r, j]
        if work.gap[r, j] > 0.0:
            pull -= driving.motor[k, n, j] - driving.motor_falling[k, n, j] * dq
        for b in range(bent.asked):
            if bent.acts[b, j]:
                a, e, f = bent.values[b, n, 0], bent.values[b, n, 1], bent.values[b, n, 2]
                torque = laws[b](a, e, f, q, dq, motor, load)
                if bent.dry[b]:
                    level += abs(torque)
                else:
                    pull += torque
        work.pull[r, j], work.level[r, j], work.drive[r, j] = pull, level, motor
        work.held[r, j] = pull - (np.sign(dq) * level if abs(dq) > STILL else 0.0)


@compiled_in_place
def _looped(looped: Looped, behind: Any, n: int, k: int, r: int, work: Work) -> Any:
    """Fill the torques that the servos' loops ask for."""
    for j in range(work.q.shape[1] if looped.goal.shape[0] else 0):
        work.servo[r, j] = _answered(looped, behind, n, k, j, work.q[r, j], work.dq[r, j])


@compiled_in_place
def _slowed_by_loops(looped: Looped, behind: Any, n: int, k: int, r: int, work: Work) -> Any:
    """Add how these fall with the rates."""
    for j in range(work.q.shape[1] if looped.goal.shape[0] else 0):
        q, dq = work.q[r, j], work.dq[r, j]
        here = _answered(looped, behind, n, k, j, q, dq)
        there = _answered(looped, behind, n, k, j, q, dq + PROBE)
        work.falling[r, j] += (here - there) / PROBE


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
def _geared(driving: Driving, n: int, k: int, r: int, work: Work) -> Any:
    """Fill the rates of motor sides with play between them and their joints, impulses left out."""
    rotor, step = at(driving.rotor, n), work.h[0, 0]
    for j in range(work.q.shape[1]):
        if work.gap[r, j] > 0.0:
            falling = driving.motor_falling[k, n, j]
            work.rotor[r, j] = driving.rotor[rotor, j] + 0.5 * step * falling
            work.motor[r, j] = work.speed[r, j] + step * work.drive[r, j] / work.rotor[r, j]


@compiled_in_place
def _diagonal(driving: Driving, n: int, r: int, j: int, work: Work) -> Any:
    """What joint j of a state feels beside the inertia of the links, kg m2."""
    falling = 0.5 * work.h[0, 0] * work.falling[r, j]
    behind = work.rotor[r, j] if work.gap[r, j] > 0.0 else 0.0
    return driving.rotor[at(driving.rotor, n), j] + falling - behind


@compiled_in_place
def _kick(
    tree: Tree, figures: Array, gravity: float, driving: Driving, n: int, room: Room, work: Work
) -> Any:
    """Fill the rates that the first state is kicked to without impulses."""
    size, step, answer = work.q.shape[1], work.h[0, 0], work.inverse[0]
    inertia(tree, room, answer)
    for j in range(size):
        work.mean[0, j] = work.dq[0, j]
        answer[j, j] += _diagonal(driving, n, 0, j, work)
    inverted(size, 0, answer)
    bias_torques(tree, figures, gravity, 0, work.dq, room, work.bias)
    if size > 1:
        kicked(0, answer, work.held, work.bias, work.dq, 0.5 * step, work.mean)
        bias_torques(tree, figures, gravity, 0, work.mean, room, work.bias)
    kicked(0, answer, work.pull, work.bias, work.dq, step, work.free)
    for kind in range(3):
        for j in range(size):
            work.given[0, kind, j] = 0.0


@compiled_in_place
def _answers(work: Work, tangents: Slopes) -> Any:
    """Fill what rates a substep makes of torques, and less of those that the mean rates feel."""
    size, step, inverse, back = work.q.shape[1], work.h[0, 0], work.inverse[0], work.back
    for i in range(size):
        for j in range(size):
            back[1, i, j] = 0.0
            for k in range(size):
                back[1, i, j] += 0.5 * step * tangents.by_rate[i, k] * inverse[k, j]
    for i in range(size):
        for j in range(size):
            back[0, i, j] = 0.0
            for k in range(size):
                back[0, i, j] += step * inverse[i, k] * back[1, k, j]


@compiled_in_place
def _follow(
    world: World,
    torques: Torques,
    w: int,
    k: int,
    r: int,
    rooms: Any,
    tangents: Slopes,
    work: Work,
) -> Any:
    """Fill the rates of a state near the first one, with the impulses of that.

    Equations of motion linear in what the two differ by, at the acceleration of the first.
    """
    n, first, driving = r * world.windows + w, world.of[0], torques.driving
    s, size, step = world.of[r], work.q.shape[1], work.h[0, 0]
    inverse, back, by_angle, by_rate = work.inverse, work.back, tangents.by_angle, tangents.by_rate
    if torques.bent.loaded:
        _loaded_near(world, r, rooms[1], tangents, work)
    _driven(torques, n, k, r, work)
    if s != first:
        more, was = world.gravity[s] - world.gravity[first], world.figures[first]
        weighing(world.tree, was, world.figures[s], more, rooms[0], tangents, r, work.more)
    for i in range(size):
        apart = _diagonal(driving, n, r, i, work) - _diagonal(driving, w, 0, i, work)
        more = work.more[r, i] + apart * work.faster[0, i]
        for j in range(size):
            more += by_angle[i, j] * (work.q[r, j] - work.q[0, j])
            more += by_rate[i, j] * (work.dq[r, j] - work.dq[0, j])
        work.mean[r, i] = work.held[r, i] - work.held[0, i] - more
        work.bias[r, i] = step * (work.pull[r, i] - work.pull[0, i] - more) + _taken_over(
            r, i, work
        )
    for i in range(size):
        rate = work.dq[r, i] + work.free[0, i] - work.dq[0, i]
        for j in range(size):
            rate += inverse[0, i, j] * work.bias[r, j] - back[0, i, j] * work.mean[r, j]
        work.free[r, i] = rate


@compiled_in_place
def _taken_over(r: int, j: int, work: Work) -> Any:
    """Give a state the impulses of the first one; what its friction gives more.

    Friction that slides gives in proportion to its level, and is right at once.
    """
    given, was = work.given, work.given[0, 0, j]
    share = work.level[r, j] / work.level[0, j] if work.level[0, j] > 0.0 else 0.0
    given[r, 0, j], given[r, 1, j], given[r, 2, j] = share * was, given[0, 1, j], given[0, 2, j]
    if work.gap[r, j] > 0.0:
        work.motor[r, j] -= given[r, 2, j] / work.rotor[r, j]
    return given[r, 0, j] - was


@compiled_in_place
def _impelled(driving: Driving, r: int, work: Work) -> Any:
    """Add the impulses to the rates of a state, and fill its acceleration with them."""
    contact = Contact(
        work.level, driving.low, driving.high, work.gap, work.rotor, work.slip, work.q, work.dq
    )
    swept(r, work.free, work.motor, work.inverse, work.h, contact, work.given[r])
    for j in range(work.q.shape[1]):
        step = max(work.h[0, 0], 1e-12)
        work.faster[r, j] = (work.free[r, j] - work.dq[r, j]) / step


@compiled_in_place
def _moved_on(work: Work) -> Any:
    """Give all states their new rates, and drift their angles by one substep."""
    step = work.h[0, 0]
    for r in range(work.q.shape[0]):
        for j in range(work.q.shape[1]):
            work.dq[r, j] = rate = work.free[r, j]
            work.speed[r, j] = work.motor[r, j] if work.gap[r, j] > 0.0 else rate
            work.slip[r, j] += step * (work.speed[r, j] - rate)
            work.q[r, j] += step * rate
