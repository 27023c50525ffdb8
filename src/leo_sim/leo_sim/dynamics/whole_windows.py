# SPDX-License-Identifier: Apache-2.0
"""Whole windows of a fixed-base robot in one compiled call.

What `substep.integrate` does one sample period after the other, for laws without a memory. What
changes with the rates alone, and linearly, while the input is held (`Laws.steady`) is found once
for all samples; other laws are asked in every substep, by their compiled functions. NumPy's
overhead per substep is most of the time of a small robot: there this is several times as fast
(benchmarks/whole_windows.py).
"""
from collections.abc import Callable
from functools import cache
import math
from typing import Any, NamedTuple
import warnings

import numba
from numba.core.errors import NumbaError, NumbaExperimentalFeatureWarning
import numpy as np

from leo_sim.common.broadcasting import Array, rows
from leo_sim.common.compiled import compiled_as
from leo_sim.dynamics.spatial import Spatial
from leo_sim.dynamics.substep import PROBE, substeps
from leo_sim.dynamics.window_kernel import Bent, Driving, Looped
from leo_sim.dynamics.window_kernel import run as run_states
from leo_sim.laws.laws import Laws, Memory
from leo_sim.laws.placement import Use

MOST_BENT = 4
"""Laws that are asked in every substep; more are left to `substep.integrate`."""
LAW = numba.float64(*[numba.float64] * 7)
MOST_BEHIND = 3
"""Laws behind the servos' loops; the catalogue has so many."""
BEHIND = numba.float64(*[numba.float64] * 4)


class Held(NamedTuple):
    """What is held over K sample periods.

    Attributes:
        inputs: V, N m or rad, (..., W, K, A).
        periods: s, (W, K).
        enabled: Booleans (..., W, K, A), or None for all motors on.
        push: Extra torque on the links, N m, (..., W, K, J), or None.
        memory: What the effects remember; it stays.
    """

    inputs: Array
    periods: Array
    enabled: Any
    push: Any
    memory: Memory


def possible(laws: Laws, q: Array, inputs: Array) -> bool:
    """Whether these laws can be run for whole windows at once, of one scan at most."""
    plain = not (laws.dynamic or laws.remembers) and laws.gap is None and laws.ground is None
    few = len(laws.bent) <= MOST_BENT and q.ndim < 4 and inputs.ndim < 5
    behind = [] if laws.servos is None else laws.servos.after
    few = few and len(behind) <= MOST_BEHIND
    return (plain and few and all(_compiled(use) for use in laws.bent)
            and all(_compiled_law(use.effect.law, BEHIND) for use in behind))


def run(laws: Laws, tree: Spatial, q: Array, dq: Array, held: Held, longest: float
        ) -> tuple[Any, Any]:
    """True angles and rates at all samples, (K + 1, ..., W, J).

    Args:
        laws: Of the model, `possible` ones.
        tree: Its body.
        q: True angles at the start, (..., W, J).
        dq: True rates there, (..., W, J).
        held: What is held over the sample periods.
        longest: Substep, s.
    """
    level, *axes = _first(laws.straight, held)
    axes += [np.shape(v)[:-1] for use in laws.bent for v in use.values.values()]
    axes += [np.shape(v)[:-2] for v in (held.push, held.enabled) if v is not None]
    axes += _loop_axes(laws)
    lead, size = np.broadcast_shapes(q.shape[:-1], dq.shape[:-1], tree.leading, *axes), q.shape[-1]
    driving = _driving(laws, held, level, (lead, size), longest)
    angles, rates = (np.empty((len(driving.parts) + 1, math.prod(lead), size)) for _ in range(2))
    angles[0], rates[0] = rows(q, lead, size, True), rows(dq, lead, size, True)
    with warnings.catch_warnings():  # functions as values
        warnings.simplefilter('ignore', NumbaExperimentalFeatureWarning)
        run_states(tree.tree, *tree.world, tree.each(lead), driving, *_bent(laws, lead, size),
                   *_looped(laws, held, (lead, size), len(driving.parts)), angles, rates)
    return angles.reshape(-1, *lead, size), rates.reshape(-1, *lead, size)


def _compiled(use: Use) -> Callable[..., float] | None:
    """The law of an effect, compiled; None where it has none, or one that cannot be compiled."""
    law = use.effect.law
    return None if use.effect.motor_side else _compiled_law(law, LAW)


@cache
def _compiled_law(law: Callable[..., Any] | None, signature: Any) -> Callable[..., float] | None:
    if law is None:
        return None
    try:
        return compiled_as(signature)(law)
    except (NumbaError, RuntimeError, TypeError):  # no place to keep it; too many parameters
        return None


def _nothing(a: float, b: float, c: float, q: float, dq: float, motor: float, load: float
             ) -> float:
    return 0.0


def _as_it_is(a: float, b: float, c: float, u: float) -> float:
    return u


def _loop_axes(laws: Laws) -> list[tuple[int, ...]]:
    """Leading axes of what a loop is made of."""
    if laws.servos is None:
        return []
    values = [v for use in laws.servos.after for v in use.values.values()]
    return [np.shape(v)[:-1] for v in (*laws.servos.loop, *laws.servos.reading(), *values)]


def _looped(laws: Laws, held: Held, axes: tuple[tuple[int, ...], int], periods: int
            ) -> tuple[Any, Looped]:
    """The laws behind the servos' loops, and the loops."""
    (lead, size), servos = axes, laws.servos
    functions = [_compiled_law(_as_it_is, BEHIND)] * MOST_BEHIND
    acts = np.zeros((MOST_BEHIND, size), np.int64)
    values = np.zeros((MOST_BEHIND, math.prod(lead), 3))
    if servos is None:
        none = np.zeros((1, size))
        return tuple(functions), Looped(np.zeros((0, 1, size)), np.zeros((0, 1, size)),
                                        *[none] * 6, values, acts)
    for b, use in enumerate(servos.after):
        functions[b] = _compiled_law(use.effect.law, BEHIND)
        acts[b, np.array(laws.actuated_joints)[use.at]] = 1
        for i, parameter in enumerate(use.effect.parameters):
            values[b, :, i] = rows(use.values[parameter.name], lead, 1)[:, 0]
    shape = (periods, *(1,) * (2 - len(lead)), *lead)
    goal, torque = (_all(part, shape, size) for part in _per_volt(laws, size, held))
    gain, rate_gain, count, supply = map(laws.at_joints, servos.loop)
    scale, rate_scale, zero = servos.reading()
    parts = (gain, rate_gain * rate_scale, count, supply, scale, zero)
    return tuple(functions), Looped(goal, torque, *(rows(part, lead, size) for part in parts),
                                    values, acts)


def _per_volt(laws: Laws, size: int, held: Held) -> tuple[Any, Any]:
    """Goals rad at the joints, and what 1 V there gives, N m, (K, ..., W, J)."""
    on, still = _enabled(held), np.zeros(size)
    goals = laws.command(_samples_first(held.inputs), on, held.memory, 0.0)[0]
    none, one = (laws.straight.torques(still, still, still, u, on, None, held.memory).motor
                 for u in (np.zeros_like(goals), np.ones_like(goals)))
    return laws.at_joints(goals), one - none


def _enabled(held: Held) -> Any:
    """Which motors are on, samples first; None for all."""
    free = held.enabled is not None and not np.all(held.enabled)
    return _samples_first(held.enabled) if free else None


def _bent(laws: Laws, lead: tuple[int, ...], size: int) -> tuple[Any, Bent]:
    """The laws that are asked in every substep, their parameters and places."""
    functions, dry = [_compiled_law(_nothing, LAW)] * MOST_BENT, np.zeros(MOST_BENT, np.int64)
    values, acts = np.zeros((MOST_BENT, math.prod(lead), 3)), np.zeros((MOST_BENT, size), np.int64)
    for b, use in enumerate(laws.bent):
        functions[b], dry[b] = _compiled(use), use.effect.dry
        acts[b, use.at] = 1
        for i, parameter in enumerate(use.effect.parameters):
            values[b, :, i] = rows(use.values[parameter.name], lead, 1)[:, 0]
    return tuple(functions), Bent(values, acts, dry, int(laws.needs_load))


def _first(laws: Laws, held: Held) -> tuple[Any, ...]:
    """Level of dry friction, and the leading axes of all that drives the first period."""
    still = np.zeros(len(laws.joints))
    u = laws.command(held.inputs[..., 0, :], None, held.memory, 0.0)[0]
    torques = laws.torques(still, still, still, u, None, None, held.memory)
    level = 0.0 if torques.level is None else torques.level
    parts = (torques.motor, torques.joint, level, laws.rotor_inertia)
    return level, *(np.shape(part)[:-1] for part in parts)


def _driving(laws: Laws, held: Held, level: Any, axes: tuple[tuple[int, ...], int],
             longest: float) -> Driving:
    """One row for every state; their leading axes and number of joints are given."""
    (lead, size), periods = axes, held.periods
    parts = np.array([substeps(float(p), longest) for p in periods.max(axis=0)])
    h = (periods.T / parts[:, None])[:, None, :, None]
    low, high = (rows(stop, (), size) for stop in laws.stops or (-np.inf, np.inf))
    shape = (len(parts), *(1,) * (2 - len(lead)), *lead)
    torque, falling, motor, motor_falling = (
        _all(values, shape, size) for values in _torques(laws, size, held))
    return Driving(torque, falling, motor, motor_falling,
                   rows(level, lead, size), rows(laws.rotor_inertia, lead, size), low, high,
                   _all(h, shape, 1)[..., 0], parts)


def _torques(laws: Laws, size: int, held: Held) -> tuple[Any, ...]:
    """`torque`, `falling`, `motor`, `motor_falling` of `Driving`, (K, ..., W, J)."""
    u, on, _ = laws.command(_samples_first(held.inputs), _enabled(held), held.memory, 0.0)
    if laws.servos is not None:  # what their loops ask for is found in every substep
        u = np.zeros_like(u)
    still = np.zeros(size)
    here, there = (laws.straight.torques(still, speed, speed, u, on, None, held.memory)
                   for speed in (still, still + PROBE))
    torque, motor = here.motor + here.joint, (here.motor - there.motor) / PROBE
    falling = motor + (here.joint - there.joint) / PROBE
    if held.push is not None:
        torque = torque + _samples_first(held.push)
    return torque, falling, here.motor, motor


def _samples_first(values: Any) -> Any:
    """Values (..., W, K, A) as (K, ..., W, A), with an axis for what is scanned."""
    first = np.moveaxis(np.asarray(values), -2, 0)
    return first if first.ndim > 3 else first[:, None]


def _all(values: Array, shape: tuple[int, ...], tail: int) -> Any:
    """Values (K, S, W, tail), or less of that, for all rows: (K, N, tail)."""
    full = np.broadcast_to(values, (*shape, tail))
    return np.ascontiguousarray(full).reshape(shape[0], -1, tail)


