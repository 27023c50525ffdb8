# SPDX-License-Identifier: Apache-2.0
"""One sample period of a robot on the ground, at two rates.

Inertia, bias, laws and contact geometry are evaluated once per period of some substeps, at its
middle; the compiled kernel then runs the substeps. Both are of second order. Rates in the bias
are extrapolated to the middle with the change over the period before. With planar dynamics a
period is one compiled call, unless a law asks for the load; where the laws stay what they are
while the input is held, all periods are.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers, rows
from leo_sim.dynamics.contact_kernel import advance, advance_periods
from leo_sim.dynamics.contact_work import Forces, Motion, Play
from leo_sim.dynamics.ground import Spheres, Touch
from leo_sim.dynamics.inertia import Dynamics
from leo_sim.dynamics.planar import Planar
from leo_sim.dynamics.substep import Drag, DRIVE, rested, slowing
from leo_sim.laws.laws import HELD, Laws, Memory

BASE = 3  # joints of a planar base


def integrate(
    laws: Laws,
    dynamics: Dynamics,
    q: Array,
    dq: Array,
    memory: Memory,
    inputs: Array,
    enabled: np.ndarray | None,
    h: Numbers,
    count: int,
    push: Numbers = 0.0,
    *,
    spheres: Spheres,
    geometry_every: int,
    switching: float,
) -> tuple[Any, Any, Memory]:
    """The state after `count` substeps of h s with the inputs held; see `substep.integrate`.

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
    planar = dynamics if isinstance(dynamics, Planar) and not laws.needs_load else None
    together = periods if planar and laws.steady and not laws.remembers else 1
    last, driven, pressed = dq, None, None
    for i in range(0, periods, together):
        if i and laws.dynamic:
            u, on, memory = laws.command(inputs, enabled, memory, inner * h)
        middle, now = q + (0.5 * inner * h) * dq, dq
        fixed: _Driven | None = driven if laws.steady else None
        law = partial(_driven, laws, drag, middle, dq, memory, u, on, push, before=driven)
        if planar:
            driven = fixed or law(None, planar.axes(q, dq))
            q, dq, memory = _moved_on(
                laws, spheres, driven, planar, q, dq, last, memory, h, inner, together
            )
        else:
            ahead = 1.5 * dq - 0.5 * last
            mass, bias = dynamics.mass_and_bias(middle, ahead)
            place, lead = (middle, ahead, mass, bias), mass.shape[:-2]
            load = dynamics.load(middle) if laws.needs_load and fixed is None else None
            if load is not None and pressed is None:
                pressed = _moved(laws, spheres, law(load, lead), q, dq, memory, place, h, inner)[3]
            driven = fixed or law(None if load is None else load + pressed, lead)
            q, dq, memory, pressed = _moved(laws, spheres, driven, q, dq, memory, place, h, inner)
        last = now
        if laws.remembers:
            memory = laws.remember(q, dq, memory, inner * h)
    return q, dq, memory


class _Driven(NamedTuple):
    """What drives the states of leading axes `shape`, the bias not yet taken off, as rows."""

    shape: tuple[int, ...]
    forces: Forces
    play: Play


def _driven(
    laws: Laws,
    drag: Drag,
    q: Array,
    dq: Array,
    memory: Memory,
    u: Array,
    enabled: np.ndarray | None,
    push: Numbers,
    load: Array | None,
    lead: tuple[int, ...],
    before: _Driven | None,
) -> _Driven:
    """The laws of the model at one instant, for the kernel; `lead` are axes of the dynamics.

    Before is an earlier instant with the same drag.
    """
    offset, speed = (dq, dq) if laws.gap is None else memory[DRIVE]
    torques = laws.torques(q, dq, speed, u, enabled, load, memory)
    linked = True if laws.gap is None else laws.gap == 0
    smooth = np.where(linked, torques.motor, 0.0) + torques.joint + push
    level = 0.0 if torques.level is None else torques.level
    if before is None:
        before = _undriven(laws, drag, linked, (smooth, dq, level, offset), lead)
    shape, size = before.shape, dq.shape[-1]
    forces = before.forces._replace(
        smooth=rows(smooth, shape, size), at=rows(dq, shape, size), level=rows(level, shape, size)
    )
    play = (
        before.play
        if laws.gap is None
        else before.play._replace(
            torque=rows(torques.motor, shape, size), at=rows(speed, shape, size)
        )
    )
    return _Driven(shape, forces, play)


def _undriven(
    laws: Laws, drag: Drag, linked: Any, moving: tuple[Any, ...], lead: tuple[int, ...]
) -> _Driven:
    """What stays the same over the periods of a step, the rest 0."""
    fixed = (
        np.where(linked, drag.motor, 0.0) + drag.joint,
        np.where(linked, laws.rotor_inertia, 0.0),
        *(laws.stops or (-np.inf, np.inf)),
    )
    shape = np.broadcast_shapes(
        *(np.shape(f)[:-1] for f in (*fixed, *moving)),
        lead,
        *(np.shape(figure) for figure in laws.ground),
    )
    size = moving[1].shape[-1]
    falling, rotor, low, high = (rows(f, shape, size) for f in fixed)
    none = np.zeros((1, size))
    play = (0.0, 1.0) if laws.gap is None else (drag.motor, laws.rotor_inertia)
    gap = rows(0.0 if laws.gap is None else laws.gap, shape, size)
    motor, inertia = (rows(f, shape, size) for f in play)
    return _Driven(
        shape,
        Forces(none, falling, none, rotor, none, low, high),
        Play(gap, none, motor, none, inertia),
    )


def _moved(
    laws: Laws,
    spheres: Spheres,
    driven: _Driven,
    q: Array,
    dq: Array,
    memory: Memory,
    place: tuple[Any, Any, Any, Any],
    h: Numbers,
    count: int,
) -> tuple[Any, Any, Memory, Any]:
    """State, memory and mean contact torque of `count` substeps of h s.

    The place is angles and rates in the middle of them, inertia and bias there.
    """
    middle, ahead, mass, bias = place
    shape, size = driven.shape, q.shape[-1]
    smooth = driven.forces.smooth - rows(bias, shape, size)
    touch = spheres.touch(middle, ahead, shape)
    motion = _motion(laws, shape, q, dq, memory)
    impulses = np.zeros((*touch.over.shape, 2))
    advance(
        motion,
        rows(mass, shape, (size, size), True),
        driven.forces._replace(smooth=smooth),
        driven.play,
        touch,
        rows(h, shape, 1)[:, 0],
        count,
        _still(memory, shape),
        impulses,
        tuple(range(q.shape[-1])),
    )
    pressed = _torque(touch, impulses, shape) / (count * h) if laws.needs_load else 0.0
    return *_state(laws, shape, motion, memory), pressed


def _moved_on(
    laws: Laws,
    spheres: Spheres,
    driven: _Driven,
    dynamics: Planar,
    q: Array,
    dq: Array,
    last: Array,
    memory: Memory,
    h: Numbers,
    inner: int,
    count: int,
) -> tuple[Any, Any, Memory]:
    """State and memory after `count` periods of `inner` substeps of h s.

    Last are the rates one period before.
    """
    shape = driven.shape
    motion = _motion(laws, shape, q, dq, memory)
    advance_periods(
        motion,
        rows(last, shape, q.shape[-1], True).copy(),
        dynamics.tree,
        dynamics.world(shape),
        spheres.floor(shape),
        driven.forces,
        driven.play,
        rows(h, shape, 1)[:, 0],
        inner,
        count,
        _still(memory, shape),
        tuple(range(q.shape[-1])),
    )
    return _state(laws, shape, motion, memory)


def _motion(laws: Laws, shape: tuple[int, ...], q: Array, dq: Array, memory: Memory) -> Motion:
    """The states of leading axes `shape` as rows of their own."""
    offset, speed = (np.zeros_like(dq), dq) if laws.gap is None else memory[DRIVE]
    return Motion(*(rows(a, shape, q.shape[-1], True).copy() for a in (q, dq, offset, speed)))


def _state(
    laws: Laws, shape: tuple[int, ...], motion: Motion, memory: Memory
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
    return (BASE * rows(held[..., None], shape, 1)[:, 0]).astype(np.int64)


def _torque(touch: Touch, impulses: Any, shape: tuple[int, ...]) -> Any:
    """What impulses at the spheres do at the joints, (..., J)."""
    levers = np.stack([touch.normal, touch.tangent], axis=2)
    return np.einsum('npkj,npk->nj', levers, impulses).reshape(*shape, levers.shape[-1])
