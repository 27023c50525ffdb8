# SPDX-License-Identifier: Apache-2.0
"""Whole windows of a fixed-base robot in one compiled call.

What `substep.integrate` does one sample period after the other. Commands and sensors may have a
memory, as no motion changes what they remember or is changed by it; of what acts on the joints
only play in the gear has one here, and laws that remember the time alone. What changes with the
rates alone, and linearly, while the input is held (`Laws.steady`), or with the time, is found once
for all samples or substeps; other laws are asked in every substep, by their compiled functions.
NumPy's overhead per substep is most of the time of a small robot:
there this is several times as fast (benchmarks/whole_windows.py).
"""

from dataclasses import dataclass, field
import math
from typing import Any

import numba
import numpy as np

from leo_sim.common.broadcasting import Array, common, rows
from leo_sim.common.compiled import compiled_law
from leo_sim.common.cores import at_once, parts
from leo_sim.dynamics.spatial import Spatial
from leo_sim.dynamics.substep import DRIVE, PROBE, rested
from leo_sim.dynamics.window_input import (
    asked,
    begun,
    Bent,
    Driving,
    every_row,
    Held,
    loop_axes,
    looped,
    loops_possible,
    Pieces,
    pieces,
    Play,
)
from leo_sim.dynamics.window_kernel import KEPT
from leo_sim.dynamics.window_kernel import run as run_states
from leo_sim.laws.laws import Laws, Memory, Torques

MOST_BENT = 4  # laws that are asked in every substep; more are left to `substep.integrate`
LEAST = 4000  # joints times intervals: less is not worth a thread
LAW = numba.float64(*[numba.float64] * 7)


@dataclass
class Along:
    """The first motion of each window, kept for more that are near it; nothing yet at first.

    By whether its loads were found, which laws that ask for none leave out.
    """

    kept: dict[bool, Array] = field(default_factory=dict)


def possible(laws: Laws, q: Array, inputs: Array) -> bool:
    """Whether these laws can be run for whole windows at once, of one scan at most."""
    plain = not laws.recalls and laws.ground is None and laws.source is None
    few = len(laws.bent) <= MOST_BENT and q.ndim < 4 and inputs.ndim < 5
    laws_of = (None if use.effect.motor_side else use.effect.law for use in laws.bent)
    return plain and few and all(compiled_law(a, LAW) for a in laws_of) and loops_possible(laws)


def run(
    laws: Laws,
    tree: Spatial,
    q: Array,
    dq: Array,
    held: Held,
    longest: float,
    near: bool | Along = False,
) -> tuple[Any, Any]:
    """Measured angles and rates at all samples, (K + 1, ..., W, J), under `possible` laws.

    From true angles and rates (..., W, J); no substep takes longer than `longest` s. `near`: of
    states (R, W, J) all are near the first of their window, see `window_kernel`; the first ones
    may be kept for further ones.
    """
    cut, size = pieces(laws, held, longest), q.shape[-1]
    play, axes = _play(laws, q, dq, held), _first(laws, held)
    given = (v for use in laws.bent for v in use.values.values())
    axes += [np.shape(v)[:-1] for v in (*play, *given)]
    axes += [np.shape(v)[:-2] for v in (held.push, held.enabled) if v is not None]
    scanned = (v for v in (cut.inputs, cut.enabled) if v is not None and v.shape[1] > 1)
    axes += [*loop_axes(laws), *(v.shape[1:-1] for v in scanned)]
    lead = common(q.shape[:-1], dq.shape[:-1], tree.of_states, *axes)
    driving = _driving(laws, cut, held.memory, (lead, size))
    gears = Play(*(rows(v, lead, size) for v in play))
    bent, loops = _bent(laws, (lead, size)), looped(laws, cut, held.memory, (lead, size))
    angles, rates = (np.empty((len(cut.parts) + 1, math.prod(lead), size)) for _ in range(2))
    angles[0], rates[0] = rows(q, lead, size, True), rows(dq, lead, size, True)
    company = near, laws.needs_load, gears.gap, lead, driving, size
    others, kept, known = _company(*company)
    windows = math.prod(lead) // (1 + others)
    bodies = tree.tree, *tree.world, tree.each(lead), math.prod(tree.leading[-2:]), others
    told = (*bodies, kept, known, driving, gears, *bent, *loops, angles, rates)
    shares = parts(windows, math.prod(lead) * len(cut.parts) * size, LEAST)
    if len(shares) > 1:
        run_states(*told, 0, 0)  # compiled by one thread: two at once compile it again
    at_once(lambda share: run_states(*told, share.start, share.stop), shares)
    states = (x.reshape(-1, *lead, size) for x in (angles, rates))
    return _sensed(laws, cut, held.memory, *states)


def _sensed(laws: Laws, cut: Pieces, memory: Memory, q: Array, dq: Array) -> tuple[Any, Any]:
    """What the encoders read at the samples, of true states at the ends of all pieces."""
    at = [0, *(cut.ends + 1)]
    if not laws.sensors.dynamic:
        return laws.sense(q[at], dq[at], memory)
    dt = cut.h.reshape(len(cut.h), *(1,) * (q.ndim - 3), -1, 1)
    angles, rates = laws.sensors.readings(q, dq, memory, dt)
    return angles[at], rates[at]


def _company(
    near: bool | Along,
    loaded: bool,
    gap: Array,
    lead: tuple[int, ...],
    driving: Driving,
    size: int,
) -> tuple[int, Array, int]:
    """How many states follow the first one of their window, what is kept of it, and if known.

    None follow where only some have play.
    """
    others, windows = (lead[0] - 1 if near and len(lead) == 2 else 0), lead[-1]
    if not ((gap > 0) == (gap[:windows] > 0).all(axis=0)).all():
        others = 0
    if not (others and isinstance(near, Along)):
        return others, np.empty((0, 0, 0)), 0
    known = loaded in near.kept
    if not known:
        numbers = (KEPT + 3) * size + 5 * size**2
        near.kept[loaded] = np.empty((windows, int(driving.parts.sum()), numbers))
    return others, near.kept[loaded], int(known)


def _play(laws: Laws, q: Array, dq: Array, held: Held) -> tuple[Any, Any, Any]:
    """Gap, slip and rate of the motor sides at the start, each (..., J)."""
    if laws.gap is None:
        return (np.zeros(len(laws.joints)),) * 3
    slip, speed = rested(laws, q, dq, held.memory)[DRIVE]
    return laws.gap, slip, speed


def _nothing(
    a: float, b: float, c: float, q: float, dq: float, motor: float, load: float
) -> float:
    return 0.0


def _bent(laws: Laws, axes: tuple[tuple[int, ...], int]) -> tuple[Any, Bent]:
    """The laws that are asked in every substep, their parameters and places."""
    dry = np.zeros(MOST_BENT, np.int64)
    dry[: len(laws.bent)] = [use.effect.dry for use in laws.bent]
    functions, values, acts = asked(laws.bent, np.arange(axes[1]), MOST_BENT, LAW, _nothing, axes)
    return functions, Bent(values, acts, dry, len(laws.bent), int(laws.needs_load))


def _first(laws: Laws, held: Held) -> list[tuple[int, ...]]:
    """The leading axes of all that drives the first period."""
    still = np.zeros(len(laws.joints))
    u = laws.command(held.inputs[..., 0, :], None, held.memory, 0.0)[0]
    torques = laws.straight.torques(still, still, still, u, None, None, held.memory)
    parts = (torques.motor, torques.joint, _level(torques), laws.rotor_inertia)
    return [np.shape(part)[:-1] for part in parts]


def _level(torques: Torques) -> Any:
    return 0.0 if torques.level is None else torques.level


def _driving(
    laws: Laws, cut: Pieces, memory: Memory, axes: tuple[tuple[int, ...], int]
) -> Driving:
    """One row for every state; their leading axes and number of joints are given."""
    (lead, size), count = axes, len(cut.parts)
    stops = (rows(stop, (), size) for stop in laws.stops or (-np.inf, np.inf))
    shape = (count, *(1,) * (2 - len(lead)), *lead)
    *torques, level = _torques(laws, size, cut, memory)
    driven = (every_row(part, shape, size) for part in torques)
    levels = rows(level, shape, size, True) if np.ndim(level) > 3 else rows(level, lead, size)
    rotor = rows(laws.rotor_inertia, lead, size)
    h = every_row(cut.h[:, None, :, None], shape, 1)[..., 0]
    return Driving._make((*driven, levels, rotor, *stops, h, cut.parts, cut.first))


def _torques(laws: Laws, size: int, cut: Pieces, memory: Memory) -> tuple[Any, ...]:
    """`torque`, `falling`, `motor`, `motor_falling` and `level` of `Driving`, (P, ..., W, J)."""
    still, u, on = np.zeros(size), cut.inputs, cut.enabled
    if laws.servos is not None:  # what their loops ask for is found in every substep
        u = np.zeros_like(u)
    here, there = (
        laws.straight.torques(still, speed, speed, u, on, None, begun(cut, memory))
        for speed in (still, still + PROBE)
    )
    torque, motor = here.motor + here.joint, (here.motor - there.motor) / PROBE
    falling = motor + (here.joint - there.joint) / PROBE
    if cut.push is not None:
        torque = torque + cut.push
    return torque, falling, here.motor, motor, _level(here)
