# SPDX-License-Identifier: Apache-2.0
"""One sample period of a robot on the ground, at two rates.

Inertia, bias, laws and contact geometry are evaluated once per period of some substeps, at its
middle; the compiled kernel then runs the substeps. Both are of second order. Rates in the bias
are extrapolated to the middle with the change over the period before. Where the laws stay what
they are while the input is held, all periods are one compiled call.
"""
from typing import Any, NamedTuple

import numpy as np

from leo_sim.contact_kernel import advance, Forces, Motion, Play, Touch
from leo_sim.engines.planar import Planar
from leo_sim.engines.planar import rows as _rows
from leo_sim.laws import HELD, Laws, Memory
from leo_sim.periods import advance_periods
from leo_sim.substep import Drag, DRIVE, Dynamics, rested, slowing

BASE = 3  # joints of a planar base


def integrate(laws: Laws, dynamics: Dynamics, q: Any, dq: Any, memory: Memory, inputs: Any,
              enabled: Any, h: Any, count: int, push: Any = 0.0, *, geometry_every: int,
              switching: float) -> tuple[Any, Any, Memory]:
    """The state after `count` substeps of h s with the inputs held; see `leo_sim.substep`.

    A command that changes meanwhile (delay, lag) is a mean over `switching` s at most.
    """
    if HELD in memory:
        dq = dq * (1.0 - memory[HELD][..., None] * (np.arange(dq.shape[-1]) < BASE))
    memory = rested(laws, q, dq, memory)
    if laws.dynamic:
        geometry_every = min(geometry_every, max(1, int(switching / np.max(h))))
    periods = -(-count // geometry_every)
    inner = -(-count // periods)
    h = np.asarray(h * (count / (periods * inner)))
    u, on, memory = laws.command(inputs, enabled, memory, inner * h)
    drag = slowing(laws, dynamics, q, dq, memory, u, on)
    if laws.steady and not laws.remembers and isinstance(dynamics, Planar):
        given = _driven(laws, drag, q, dq, memory, u, on, None, push, dynamics.leading(q, dq))
        return _moved_on(laws, given, dynamics, q, dq, memory, h, inner, periods)
    last, driven, pressed = dq, None, None
    for i in range(periods):
        if i and laws.dynamic:
            u, on, memory = laws.command(inputs, enabled, memory, inner * h)
        middle = q + (0.5 * inner * h) * dq
        ahead = 1.5 * dq - 0.5 * last
        mass, bias = dynamics.mass_and_bias(middle, ahead)
        last, lead = dq, mass.shape[:-2]
        place = middle, ahead, mass, bias
        if driven is None or not laws.steady:
            load = dynamics.load(middle) if laws.needs_load else None
            if load is not None and pressed is None:
                trial = _driven(laws, drag, middle, dq, memory, u, on, load, push, lead)
                pressed = _moved(laws, trial, q, dq, memory, place, h, inner)[3]
            load = None if load is None else load + pressed
            driven = _driven(laws, drag, middle, dq, memory, u, on, load, push, lead)
        q, dq, memory, pressed = _moved(laws, driven, q, dq, memory, place, h, inner)
        if laws.remembers:
            memory = laws.remember(q, dq, memory, inner * h)
    return q, dq, memory


class _Driven(NamedTuple):
    """What drives the states of leading axes `shape`, the bias not yet taken off, as rows."""

    shape: tuple[int, ...]
    forces: Forces
    play: Play


def _driven(laws: Laws, drag: Drag, q: Any, dq: Any, memory: Memory, u: Any, enabled: Any,
            load: Any, push: Any, lead: tuple[int, ...]) -> _Driven:
    """The laws of the model at one instant, for the kernel; `lead` are axes of the dynamics."""
    offset, speed = (dq, dq) if laws.gap is None else memory[DRIVE]
    torques = laws.torques(q, dq, speed, u, enabled, load, memory)
    linked = True if laws.gap is None else laws.gap == 0
    smooth = np.where(linked, torques.motor, 0.0) + torques.joint + push
    size = dq.shape[-1]
    given = Forces(smooth, np.where(linked, drag.motor, 0.0) + drag.joint, dq,
                   np.where(linked, laws.rotor_inertia, 0.0),
                   0.0 if torques.level is None else torques.level,
                   *(laws.stops or (-np.inf, np.inf)))
    shape = np.broadcast_shapes(*(np.shape(f)[:-1] for f in (*given, offset)), lead,
                                *(np.shape(figure) for figure in laws.ground))
    forces = Forces(*(_rows(f, shape, size) for f in given))
    play = (0.0, 0.0, 0.0, 0.0, 1.0) if laws.gap is None else (
        laws.gap, torques.motor, drag.motor, speed, laws.rotor_inertia)
    return _Driven(shape, forces, Play(*(_rows(f, shape, size) for f in play)))


def _moved(laws: Laws, driven: _Driven, q: Any, dq: Any, memory: Memory,
           place: tuple[Any, Any, Any, Any], h: Any, count: int) -> tuple[Any, Any, Memory, Any]:
    """State, memory and mean contact torque of `count` substeps of h s.

    The place is angles and rates in the middle of them, inertia and bias there.
    """
    middle, ahead, mass, bias = place
    shape, size = driven.shape, q.shape[-1]
    smooth = driven.forces.smooth - _rows(bias, shape, size)
    touch = laws.spheres.touch(middle, ahead, shape)
    motion = _motion(laws, shape, q, dq, memory)
    impulses = np.zeros((*touch.over.shape, 2))
    advance(motion, _rows(mass, shape, (size, size), True), driven.forces._replace(smooth=smooth),
            driven.play, touch, _rows(h, shape, 1)[:, 0], count, _still(memory, shape), impulses,
            _axes(q))
    pressed = _torque(touch, impulses, shape) / (count * h) if laws.needs_load else 0.0
    return *_state(laws, shape, motion, memory), pressed


def _moved_on(laws: Laws, driven: _Driven, dynamics: Planar, q: Any, dq: Any, memory: Memory,
              h: Any, inner: int, count: int) -> tuple[Any, Any, Memory]:
    """State and memory after `count` periods of `inner` substeps of h s."""
    shape = driven.shape
    motion = _motion(laws, shape, q, dq, memory)
    advance_periods(motion, dynamics.tree, dynamics.world(shape), laws.spheres.floor(shape),
                    driven.forces, driven.play, _rows(h, shape, 1)[:, 0], inner, count,
                    _still(memory, shape), _axes(q))
    return _state(laws, shape, motion, memory)


def _axes(q: Any) -> tuple[int, ...]:
    """One entry per joint, see `contact_kernel.Work`."""
    return tuple(range(q.shape[-1]))


def _motion(laws: Laws, shape: tuple[int, ...], q: Any, dq: Any, memory: Memory) -> Motion:
    """The states of leading axes `shape` as rows of their own."""
    offset, speed = (np.zeros_like(dq), dq) if laws.gap is None else memory[DRIVE]
    return Motion(*(_rows(a, shape, q.shape[-1], True).copy() for a in (q, dq, offset, speed)))


def _state(laws: Laws, shape: tuple[int, ...], motion: Motion, memory: Memory
           ) -> tuple[Any, Any, Memory]:
    """The reverse of `_motion`."""
    q, dq, offset, speed = (a.reshape(*shape, a.shape[-1]) for a in motion)
    if laws.gap is not None:
        memory = {**memory, DRIVE: np.stack([offset, np.where(laws.gap > 0, speed, dq)])}
    return q, dq, memory


def _still(memory: Memory, shape: tuple[int, ...]) -> Any:
    """How many joints, the first ones, do not move, (N,) or (1,)."""
    if HELD not in memory:
        return np.zeros(1, np.int64)
    held = np.asarray(memory[HELD])
    return (BASE * _rows(held[..., None], shape, 1)[:, 0]).astype(np.int64)


def _torque(touch: Touch, impulses: Any, shape: tuple[int, ...]) -> Any:
    """What impulses at the spheres do at the joints, (..., J)."""
    levers = np.stack([touch.normal, touch.tangent], axis=2)
    return np.einsum('npkj,npk->nj', levers, impulses).reshape(*shape, levers.shape[-1])
