# SPDX-License-Identifier: Apache-2.0
"""What drives whole windows, as `window_kernel` takes it; position servos' own loops among it.

What is held is cut into the periods over which it is constant: the sample periods; or the
substeps, where a command changes between samples (delay, lag), a law knows the time, or a sensor
needs to know what the joints did there.
"""

from collections.abc import Callable, Sequence
import math
from typing import Any, NamedTuple

import numba
import numpy as np

from leo_sim.common.broadcasting import Array, filled, Indices, Numbers, rows
from leo_sim.common.compiled import compiled_law, Functions
from leo_sim.dynamics.substep import substeps
from leo_sim.laws.laws import Laws, Memory, TIME
from leo_sim.laws.sensors import Use

MOST_BEHIND = 3  # laws behind the servos' loops; the catalogue has so many
BEHIND = numba.float64(*[numba.float64] * 4)


class Held(NamedTuple):
    """What is held over K sample periods."""

    inputs: Array  # V, N m or rad, (..., W, K, A)
    periods: Array  # s, (W, K)
    enabled: Any  # booleans (..., W, K, A), or None for all motors on
    push: Any  # extra torque on the links, N m, (..., W, K, J), or None
    memory: Memory  # what the effects remember; it stays


class Pieces(NamedTuple):
    """What is constant over each of P periods, for S values of what is scanned (1 for none)."""

    inputs: Array  # at the motors, V, N m or rad, (P, S, W, A)
    enabled: Any  # which are on, or for what share of the time, (P, S, W, A); None for all on
    push: Any  # extra torque on the links, N m, (P, S, W, J), or None
    h: Array  # substep, s, (P, W)
    parts: Indices  # substeps in each of them, (P,)
    first: Indices  # 1 where a sample period begins, (P,)
    ends: Indices  # the samples are at the ends of these, (K,)


class Driving(NamedTuple):
    """What drives N states over K periods, of samples or of substeps."""

    torque: Array  # of motors and joints at rates of 0, gravity left out, N m, (K, N, J)
    falling: Array  # how it falls with the rates, N m s/rad, (K, N, J)
    motor: Array  # what of the two is the motors'; (K, N, J) where a law asks
    motor_falling: Array
    level: Array  # of dry friction, N m, (K N, N or 1, J)
    rotor: Array  # inertia of the motor sides, kg m2, (N or 1, J)
    low: Array  # stops, rad, (1, J)
    high: Array
    h: Array  # substep, s, (K, N)
    parts: Indices  # substeps in a period, (K,)
    first: Indices  # 1 where a sample period begins, (K,)


class Play(NamedTuple):
    """Dead zones between the motors and their joints."""

    gap: Array  # their width, 0 where there is none, rad, (N or 1, J)
    slip: Array  # angle of each motor side less that of its joint at the start, rad, (N or 1, J)
    speed: Array  # rate of each motor side at the start, rad/s, (N or 1, J)


class Bent(NamedTuple):
    """Laws that are asked in every substep, B of them."""

    values: Array  # their parameters, 0 where there is none, (B, N, 3)
    acts: Indices  # 1 at the joints where they act, (B, J)
    dry: Indices  # 1 where the law is one of dry friction, (B,)
    asked: int  # how many there are; those after them do nothing
    loaded: int  # whether one looks at the load, 1 or 0


class Looped(NamedTuple):
    """Position servos' own loops, of N states over K sample periods; see `laws.servo`."""

    goal: Array  # rad, (K, N, J); of no periods where inputs are no goals
    torque: Array  # what 1 V gives, N m/V, (K, N, J); 0 where there is no motor, or a free one
    gain: Array  # (N or 1, J)
    rate_gain: Array
    grain: Array
    supply: Array
    scale: Array  # a servo reads scale q + zero at the angle q, (N or 1, J)
    zero: Array
    values: Array  # parameters of the laws behind the loop, 0 where there is none, (B, N, 3)
    acts: Indices  # 1 at the joints where these act, (B, J)


def pieces(laws: Laws, held: Held, longest: float) -> Pieces:
    """Cut what is held; no substep takes longer than `longest` s."""
    parts = np.array([substeps(float(p), longest) for p in held.periods.max(axis=0)])
    h, push = held.periods.T / parts[:, None], held.push
    push = None if push is None else _samples_first(push)
    if not (laws.dynamic or laws.timed or laws.sensors.dynamic):
        one, ends = np.ones_like(parts), np.arange(len(parts))
        return Pieces(*_steadily(laws, held), push, h, parts, one, ends)
    of, ends = np.repeat(np.arange(len(parts)), parts), np.cumsum(parts) - 1
    first = np.diff(of, prepend=-1)
    u, on = _changing(laws, held, of, h) if laws.dynamic else _steadily(laws, held, of)
    return Pieces(u, on, None if push is None else push[of], h[of], np.ones_like(of), first, ends)


def begun(cut: Pieces, memory: Memory) -> Memory:
    """The time at which each piece begins, (P, 1, W, 1)."""
    spent = cut.h * cut.parts[:, None]
    return {TIME: memory.get(TIME, 0.0) + (np.cumsum(spent, axis=0) - spent)[:, None, :, None]}


def _steadily(laws: Laws, held: Held, of: Any = slice(None)) -> tuple[Any, Any]:
    """Inputs at the motors and which are on, the same over a sample period."""
    on = None if _all_on(held) else _samples_first(held.enabled)
    u, on, _ = laws.command(_samples_first(held.inputs), on, held.memory, 0.0)
    return u[of], None if on is None else on[of]


def _changing(laws: Laws, held: Held, of: Indices, h: Array) -> tuple[Any, Any]:
    """Inputs at the motors and which are on, substep by substep; each is of a sample period."""
    memory, steps = held.memory, []
    for k in of:
        on = None if _all_on(held) else held.enabled[..., k, :]
        u, on, memory = laws.command(held.inputs[..., k, :], on, memory, h[k][:, None])
        steps.append(np.broadcast_arrays(u, 1.0 if on is None else on))
    u, on = (_scanned(np.stack(np.broadcast_arrays(*each))) for each in zip(*steps, strict=True))
    return u, None if np.all(on == 1.0) else on


def _samples_first(values: Numbers) -> Any:
    """Values (..., W, K, A) as (K, S, W, A)."""
    return _scanned(np.moveaxis(np.asarray(values), -2, 0))


def _scanned(values: Any) -> Any:
    """Values (P, S, W, A); without what is scanned S is 1."""
    return values if values.ndim > 3 else values[:, None]


def _all_on(held: Held) -> bool:
    return held.enabled is None or bool(np.all(held.enabled))


def every_row(values: Array, shape: tuple[int, ...], tail: int) -> Any:
    """Values (P, S, W, tail), or less of that, for all rows: (P, N, tail), a copy.

    A view that must not be written to would be another type to the compiled kernel.
    """
    return filled((*shape, tail), values).reshape(shape[0], -1, tail)


def loops_possible(laws: Laws) -> bool:
    """Whether all that acts behind the loops can be compiled, and no gear has play."""
    if laws.servos is None:
        return True
    behind = laws.servos.after
    few = laws.gap is None and len(behind) <= MOST_BEHIND
    return few and all(compiled_law(u.effect.law, BEHIND) for u in behind)


def loop_axes(laws: Laws) -> list[tuple[int, ...]]:
    if laws.servos is None:
        return []
    values = [v for use in laws.servos.after for v in use.values.values()]
    return [np.shape(v)[:-1] for v in (*laws.servos.loop, *laws.servos.reading(), *values)]


def asked(
    uses: Sequence[Use],
    joints: Indices,
    most: int,
    kind: Any,
    nothing: Callable[..., float],
    axes: tuple[tuple[int, ...], int],
) -> tuple[Functions, Array, Indices]:
    """Laws as `most` compiled functions of a kind, their parameters, and 1 where they act.

    For states of leading axes and so many joints: parameters (B, N, 3), acts (B, J). Joints are
    those of the places where the laws can act; `nothing` stands where there is no law.
    """
    lead, size = axes
    functions = [compiled_law(nothing, kind)] * most
    values, acts = np.zeros((most, math.prod(lead), 3)), np.zeros((most, size), np.int64)
    for b, use in enumerate(uses):
        functions[b] = compiled_law(use.effect.law, kind)
        acts[b, joints[use.at]] = 1
        for i, parameter in enumerate(use.effect.parameters):
            values[b, :, i] = rows(use.values[parameter.name], lead, 1)[:, 0]
    return Functions(functions), values, acts


def looped(
    laws: Laws, cut: Pieces, memory: Memory, axes: tuple[tuple[int, ...], int]
) -> tuple[Functions, Looped]:
    """The laws behind the loops, and the loops, for states of leading axes and so many joints."""
    (lead, size), servos = axes, laws.servos
    behind, joints = servos.after if servos else (), np.array(laws.actuated_joints, np.int64)
    functions, values, acts = asked(behind, joints, MOST_BEHIND, BEHIND, _as_it_is, axes)
    if servos is None:
        none, never = np.zeros((1, size)), np.zeros((0, 1, size))
        return functions, Looped(never, never, none, none, none, none, none, none, values, acts)
    shape = (len(cut.parts), *(1,) * (2 - len(lead)), *lead)
    driven = (every_row(part, shape, size) for part in _per_volt(laws, size, cut, memory))
    gain, rate_gain, grain, supply, *_ = map(laws.at_joints, servos.loop)
    scale, rate_scale, zero = servos.reading()
    figures = (gain, rate_gain * rate_scale, grain, supply, scale, zero)
    parts = *driven, *(rows(f, lead, size) for f in figures), values, acts
    return functions, Looped._make(parts)


def _per_volt(laws: Laws, size: int, cut: Pieces, memory: Memory) -> tuple[Any, Any]:
    """Goals rad at the joints, and what 1 V there gives, N m, (P, ..., W, J)."""
    still = np.zeros(size)
    none, one = (
        laws.straight.torques(still, still, still, u, cut.enabled, None, begun(cut, memory)).motor
        for u in (np.zeros_like(cut.inputs), np.ones_like(cut.inputs))
    )
    return laws.at_joints(cut.inputs), one - none


def _as_it_is(a: float, b: float, c: float, u: float) -> float:
    return u
