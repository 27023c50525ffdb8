# SPDX-License-Identifier: Apache-2.0
"""One sample period of a robot on the ground, at two rates.

Inertia, bias, laws and contact geometry are evaluated once per period of some substeps, at its
middle; the compiled kernel then runs the substeps. Both are of second order. Rates in the bias
are extrapolated to the middle with the change over the period before.
"""
from typing import Any

import numpy as np

from leo_sim.contact_kernel import advance, Forces, Motion, Play, Touch
from leo_sim.laws import HELD, Laws, Memory
from leo_sim.substep import Drag, DRIVE, Dynamics, rested, slowing

BASE = 3  # joints of a planar base


def integrate(laws: Laws, dynamics: Dynamics, q: Any, dq: Any, memory: Memory, inputs: Any,
              enabled: Any, h: Any, count: int, push: Any = 0.0, geometry_every: int = 1
              ) -> tuple[Any, Any, Memory]:
    """The state after `count` substeps of h s with the inputs held; see `leo_sim.substep`."""
    if HELD in memory:
        dq = np.concatenate([np.zeros_like(dq[..., :BASE]), dq[..., BASE:]], axis=-1)
    memory = rested(laws, q, dq, memory)
    periods = -(-count // geometry_every)
    inner = -(-count // periods)
    h = np.asarray(h * (count / (periods * inner)))
    u, on, memory = laws.command(inputs, enabled, memory, inner * h)
    drag = slowing(laws, dynamics, q, dq, memory, u, on)
    last = dq
    for i in range(periods):
        if i and laws.dynamic:
            u, on, memory = laws.command(inputs, enabled, memory, inner * h)
        ahead = 1.5 * dq - 0.5 * last
        last = dq
        q, dq, memory = _period(laws, dynamics, q, dq, ahead, memory, u, on, h, inner, drag,
                                push)
        if laws.remembers:
            memory = laws.remember(q, dq, memory, inner * h)
    return q, dq, memory


def _period(laws: Laws, dynamics: Dynamics, q: Any, dq: Any, ahead: Any, memory: Memory, u: Any,
            enabled: Any, h: Any, inner: int, drag: Drag, push: Any) -> tuple[Any, Any, Memory]:
    """One period between two evaluations of the geometry."""
    middle = q + (0.5 * inner * h) * dq
    mass, bias = dynamics.mass_and_bias(middle, ahead)
    load = dynamics.load(middle) if laws.needs_load else None
    offset, speed = memory[DRIVE] if laws.gap is not None else (np.zeros_like(dq), dq)
    torques = laws.torques(middle, dq, speed, u, enabled, load, memory)
    linked = True if laws.gap is None else laws.gap == 0
    smooth = np.where(linked, torques.motor, 0.0) + torques.joint + push - bias
    over, normal, tangent = laws.spheres.over(middle)
    shape = np.broadcast_shapes(smooth.shape[:-1], mass.shape[:-2], over.shape[:-1])
    size, low_high = q.shape[-1], laws.stops
    forces = Forces(
        _rows(smooth, shape), _rows(np.where(linked, drag.motor, 0.0) + drag.joint, shape, size),
        _rows(np.where(linked, laws.rotor_inertia, 0.0), shape, size),
        _rows(0.0 if torques.level is None else torques.level, shape, size), _rows(dq, shape),
        *low_high)
    play = Play(*(_rows(f, shape, size) for f in (
        (0.0, 0.0, 0.0, 1.0, 0.0) if laws.gap is None else
        (laws.gap, torques.motor, drag.motor, laws.rotor_inertia, speed))))
    spheres = laws.spheres
    touch = Touch(_rows(over, shape, whole=True), _rows(normal, shape, deep=2, whole=True),
                  _rows(tangent, shape, deep=2, whole=True), _rows(middle, shape, whole=True),
                  _rows(spheres.stiffness, shape), _rows(spheres.damping, shape),
                  _rows(spheres.friction, shape))
    state = Motion(*(_rows(a, shape, size, whole=True).copy()
                     for a in (q, dq, offset, speed)))
    impulses = np.zeros((len(state.q), over.shape[-1], 2))
    held = BASE if HELD in memory else 0
    advance(state, _rows(mass, shape, deep=2, whole=True), forces, play, touch,
            _rows(h[..., None] if h.ndim == 0 else h, shape)[:, 0], inner, held, impulses)
    q, dq, offset, speed = (a.reshape(*shape, size) for a in state)
    if laws.gap is not None:
        speed = np.where(laws.gap > 0, speed, dq)
        memory = {**memory, DRIVE: np.stack([offset, speed])}
    return q, dq, memory


def _rows(values: Any, shape: tuple[int, ...], size: int = 0, deep: int = 1, whole: bool = False
          ) -> Any:
    """Values (..., *tail) as contiguous rows (N, *tail), or (1, *tail) where all are the same.

    Args:
        values: An array with `deep` trailing axes; a float stands for `size` equal ones.
        shape: Leading axes of the state.
        size: Columns, where values may be fewer.
        deep: Trailing axes.
        whole: One row per state, even where all are the same.
    """
    values = np.asarray(values, dtype=float)
    if size and (values.ndim == 0 or values.shape[-1] != size):
        values = np.broadcast_to(values, (*values.shape[:-1], size))
    lead, tail = values.shape[:-deep], values.shape[-deep:]
    if not whole and all(n == 1 for n in lead):
        return np.ascontiguousarray(values).reshape(1, *tail)
    return np.ascontiguousarray(np.broadcast_to(values, shape + tail)).reshape(-1, *tail)
