# SPDX-License-Identifier: Apache-2.0
"""Position servos' own loops as the kernel of whole windows takes them."""

import math
from typing import Any

import numba
import numpy as np

from leo_sim.common.broadcasting import rows
from leo_sim.common.compiled import compiled_law, Functions
from leo_sim.dynamics.window_input import every_row, Pieces
from leo_sim.dynamics.window_kernel import Looped
from leo_sim.laws.laws import Laws, Memory
from leo_sim.laws.servo import Servos

MOST_BEHIND = 3
"""Laws behind the servos' loops; the catalogue has so many."""
BEHIND = numba.float64(*[numba.float64] * 4)


def loops_possible(laws: Laws) -> bool:
    """Whether all that acts behind the loops can be compiled, and no gear has play."""
    if laws.servos is None:
        return True
    behind = laws.servos.after
    few = laws.gap is None and len(behind) <= MOST_BEHIND
    return few and all(compiled_law(u.effect.law, BEHIND) for u in behind)


def loop_axes(laws: Laws) -> list[tuple[int, ...]]:
    """Leading axes of what the loops are made of."""
    if laws.servos is None:
        return []
    values = [v for use in laws.servos.after for v in use.values.values()]
    return [np.shape(v)[:-1] for v in (*laws.servos.loop, *laws.servos.reading(), *values)]


def looped(
    laws: Laws, cut: Pieces, memory: Memory, axes: tuple[tuple[int, ...], int]
) -> tuple[Functions, Looped]:
    """The laws behind the loops, and the loops, for states of leading axes and so many joints."""
    (lead, size), servos = axes, laws.servos
    functions = [compiled_law(_as_it_is, BEHIND)] * MOST_BEHIND
    acts = np.zeros((MOST_BEHIND, size), np.int64)
    values = np.zeros((MOST_BEHIND, math.prod(lead), 3))
    if servos is None:
        none, never = np.zeros((1, size)), np.zeros((0, 1, size))
        return Functions(functions), Looped(
            never, never, none, none, none, none, none, none, values, acts
        )
    for b, use in enumerate(servos.after):
        functions[b] = compiled_law(use.effect.law, BEHIND)
        acts[b, np.array(laws.actuated_joints)[use.at]] = 1
        for i, parameter in enumerate(use.effect.parameters):
            values[b, :, i] = rows(use.values[parameter.name], lead, 1)[:, 0]
    shape = (len(cut.parts), *(1,) * (2 - len(lead)), *lead)
    goal, torque = (every_row(part, shape, size) for part in _per_volt(laws, size, cut, memory))
    gain, rate_gain, grain, supply, scale, zero = (
        rows(figure, lead, size) for figure in _figures(laws, servos)
    )
    return Functions(functions), Looped(
        goal, torque, gain, rate_gain, grain, supply, scale, zero, values, acts
    )


def _figures(laws: Laws, servos: Servos) -> tuple[Any, ...]:
    """Gain, rate gain, grain and supply, and scale and zero of what is read, (..., J)."""
    gain, rate_gain, grain, supply = map(laws.at_joints, servos.loop)
    scale, rate_scale, zero = servos.reading()
    return gain, rate_gain * rate_scale, grain, supply, scale, zero


def _per_volt(laws: Laws, size: int, cut: Pieces, memory: Memory) -> tuple[Any, Any]:
    """Goals rad at the joints, and what 1 V there gives, N m, (P, ..., W, J)."""
    still = np.zeros(size)
    none, one = (
        laws.straight.torques(still, still, still, u, cut.enabled, None, memory).motor
        for u in (np.zeros_like(cut.inputs), np.ones_like(cut.inputs))
    )
    return laws.at_joints(cut.inputs), one - none


def _as_it_is(a: float, b: float, c: float, u: float) -> float:
    return u
