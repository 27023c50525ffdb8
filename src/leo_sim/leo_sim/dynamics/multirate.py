# SPDX-License-Identifier: Apache-2.0
"""One sample period of a robot on the ground, at two rates.

Inertia, bias, laws and contact geometry are evaluated once per period of some substeps, at its
middle; the compiled kernel then runs the substeps. Both are of second order. Rates in the bias
are extrapolated to the middle with the change over the period before. With our own dynamics a
period is one compiled call, unless a law asks for the load; where the laws stay what they are
while the input is held, all periods are.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, common, Numbers, rows
from leo_sim.description.robot_file import SchemeFile
from leo_sim.dynamics.contact_kernel import advance, advance_periods
from leo_sim.dynamics.contact_work import Forces, Motion, Play
from leo_sim.dynamics.ground import Spheres, Touch
from leo_sim.dynamics.inertia import Dynamics
from leo_sim.dynamics.spatial import Spatial
from leo_sim.dynamics.substep import Drag, DRIVE, Period, rested, slowing
from leo_sim.laws.laws import HELD, Laws, Memory

BASE = 3  # joints of a planar base


def integrate(
    laws: Laws,
    dynamics: Dynamics,
    q: Array,
    dq: Array,
    memory: Memory,
    given: Period,
    *,
    spheres: Spheres,
    scheme: SchemeFile,
) -> tuple[Any, Any, Memory]:
    """The state after what is given for a sample period, as `substep.integrate` has it.

    A command that changes meanwhile (delay, lag) is a mean over `scheme.switching` s at most.
    """
    inputs, enabled, h, count, push = given
    inner = scheme.geometry_every
    if HELD in memory:
        dq = dq * (1.0 - memory[HELD][..., None] * (np.arange(dq.shape[-1]) < BASE))
    memory = rested(laws, q, dq, memory)
    if laws.dynamic:
        inner = min(inner, max(1, int(scheme.switching / np.max(h))))
    periods = -(-count // inner)
    inner = -(-count // periods)
    h = np.asarray(h * (count / (periods * inner)))
    u, on, memory = laws.command(inputs, enabled, memory, inner * h)
    drag = slowing(laws, dynamics, q, dq, memory, u, on)
    tree = dynamics if isinstance(dynamics, Spatial) and not laws.needs_load else None
    together = periods if tree and laws.steady and not laws.remembers else 1
    loop = _InnerLoop(laws, spheres, drag, push, h, inner)
    last, driven, pressed = dq, None, None
    for i in range(0, periods, together):
        if i and laws.dynamic:
            u, on, memory = laws.command(inputs, enabled, memory, inner * h)
        middle, now = q + (0.5 * inner * h) * dq, dq
        fixed: _Driven | None = driven if laws.steady else None
        law = partial(loop.driven, middle, dq, memory, u, on, before=driven)
        if tree:
            driven = fixed or law(None, tree.axes(q, dq))
            q, dq, memory = loop.moved_on(driven, tree, q, dq, last, memory, together)
        else:
            ahead = 1.5 * dq - 0.5 * last
            mass, bias = dynamics.mass_and_bias(middle, ahead)
            place, lead = (middle, ahead, mass, bias), mass.shape[:-2]
            load = dynamics.load(middle) if laws.needs_load and fixed is None else None
            if load is not None and pressed is None:
                pressed = loop.moved(law(load, lead), q, dq, memory, place)[3]
            driven = fixed or law(None if load is None else load + pressed, lead)
            q, dq, memory, pressed = loop.moved(driven, q, dq, memory, place)
        last = now
        if laws.remembers:
            memory = laws.remember(q, dq, memory, inner * h)
    return q, dq, memory


class _Driven(NamedTuple):
    """What drives the states of leading axes `shape`, the bias not yet taken off, as rows."""

    shape: tuple[int, ...]
    forces: Forces
    play: Play


class _InnerLoop(NamedTuple):
    """`inner` substeps of h s between two looks at the geometry, and what does not change."""

    laws: Laws
    spheres: Spheres
    drag: Drag
    push: Numbers
    h: Array
    inner: int

    def driven(
        self,
        q: Array,
        dq: Array,
        memory: Memory,
        u: Array,
        enabled: np.ndarray | None,
        load: Array | None,
        lead: tuple[int, ...],
        before: _Driven | None,
    ) -> _Driven:
        """The laws at one instant, for the kernel; `lead` are axes of the dynamics."""
        laws = self.laws
        offset, speed = (dq, dq) if laws.gap is None else memory[DRIVE]
        torques = laws.torques(q, dq, speed, u, enabled, load, memory)
        linked = True if laws.gap is None else laws.gap == 0
        smooth = np.where(linked, torques.motor, 0.0) + torques.joint + self.push
        level = 0.0 if torques.level is None else torques.level
        if before is None:
            before = self._undriven(linked, (smooth, dq, level, offset), lead)
        shape, size = before.shape, dq.shape[-1]
        smooth, at, level = (rows(each, shape, size) for each in (smooth, dq, level))
        play = before.play
        if laws.gap is not None:
            torque, speed = rows(torques.motor, shape, size), rows(speed, shape, size)
            play = play._replace(torque=torque, at=speed)
        return _Driven(shape, before.forces._replace(smooth=smooth, at=at, level=level), play)

    def _undriven(self, linked: Any, moving: tuple[Any, ...], lead: tuple[int, ...]) -> _Driven:
        """What stays the same over the periods of a step, the rest 0."""
        laws, drag = self.laws, self.drag
        fixed = (
            np.where(linked, drag.motor, 0.0) + drag.joint,
            np.where(linked, laws.rotor_inertia, 0.0),
            *(laws.stops or (-np.inf, np.inf)),
        )
        shape = common(
            *(np.shape(f)[:-1] for f in (*fixed, *moving)), lead, *map(np.shape, laws.ground)
        )
        size = moving[1].shape[-1]
        falling, rotor, low, high = (rows(f, shape, size) for f in fixed)
        none = np.zeros((1, size))
        play = (0.0, 1.0) if laws.gap is None else (drag.motor, laws.rotor_inertia)
        gap = rows(0.0 if laws.gap is None else laws.gap, shape, size)
        motor, inertia = (rows(f, shape, size) for f in play)
        forces = Forces(none, falling, none, rotor, none, low, high)
        return _Driven(shape, forces, Play(gap, none, motor, none, inertia))

    def moved(
        self, driven: _Driven, q: Array, dq: Array, memory: Memory, place: tuple[Any, ...]
    ) -> tuple[Any, Any, Memory, Any]:
        """State, memory and mean contact torque after a period.

        The place is angles and rates in the middle of it, inertia and bias there.
        """
        middle, ahead, mass, bias = place
        shape, size = driven.shape, q.shape[-1]
        touch = self.spheres.touch(middle, ahead, shape)
        motion, impulses = self._motion(shape, q, dq, memory), np.zeros((*touch.over.shape, 2))
        forces = driven.forces._replace(smooth=driven.forces.smooth - rows(bias, shape, size))
        mass, h = rows(mass, shape, (size, size), True), rows(self.h, shape, 1)[:, 0]
        held, axes = _still(memory, shape), tuple(range(size))
        advance(motion, mass, forces, driven.play, touch, h, self.inner, held, impulses, axes)
        pressed = 0.0
        if self.laws.needs_load:
            pressed = _torque(touch, impulses, shape) / (self.inner * self.h)
        return *self._state(shape, motion, memory), pressed

    def moved_on(
        self,
        driven: _Driven,
        dynamics: Spatial,
        q: Array,
        dq: Array,
        last: Array,
        memory: Memory,
        count: int,
    ) -> tuple[Any, Any, Memory]:
        """State and memory after `count` periods; last are the rates one period before."""
        shape, size = driven.shape, q.shape[-1]
        motion, last = self._motion(shape, q, dq, memory), rows(last, shape, size, True).copy()
        world = *dynamics.world, dynamics.each(shape), self.spheres.floor(shape)
        h, held, axes = rows(self.h, shape, 1)[:, 0], _still(memory, shape), tuple(range(size))
        advance_periods(
            *(motion, last, dynamics.tree, *world, driven.forces, driven.play),
            *(h, self.inner, count, held, axes),
        )
        return self._state(shape, motion, memory)

    def _motion(self, shape: tuple[int, ...], q: Array, dq: Array, memory: Memory) -> Motion:
        """The states of leading axes `shape` as rows of their own."""
        offset, speed = (np.zeros_like(dq), dq) if self.laws.gap is None else memory[DRIVE]
        return Motion(*(rows(a, shape, q.shape[-1], True).copy() for a in (q, dq, offset, speed)))

    def _state(
        self, shape: tuple[int, ...], motion: Motion, memory: Memory
    ) -> tuple[Any, Any, Memory]:
        q, dq, offset, speed = (a.reshape(*shape, a.shape[-1]) for a in motion)
        gap = self.laws.gap
        if gap is not None:
            memory = {**memory, DRIVE: np.stack([offset, np.where(gap > 0, speed, dq)])}
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
