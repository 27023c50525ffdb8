# SPDX-License-Identifier: Apache-2.0
"""What is held over whole windows, cut into the periods over which it is constant.

These are the sample periods; or the substeps, where a command changes between samples (delay, lag)
or a sensor needs to know what the joints did there.
"""

from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, filled, Indices, Numbers
from leo_sim.dynamics.substep import substeps
from leo_sim.laws.laws import Laws, Memory


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


class Pieces(NamedTuple):
    """What is constant over each of P periods, for S values of what is scanned (1 for none).

    Attributes:
        inputs: At the motors, V, N m or rad, (P, S, W, A).
        enabled: Which are on, or for what share of the time, (P, S, W, A); None for all on.
        push: Extra torque on the links, N m, (P, S, W, J), or None.
        h: Substep, s, (P, W).
        parts: Substeps in each of them, (P,).
        first: 1 where a sample period begins, (P,).
        ends: The samples are at the ends of these, (K,).
    """

    inputs: Array
    enabled: Any
    push: Any
    h: Array
    parts: Indices
    first: Indices
    ends: Indices


def pieces(laws: Laws, held: Held, longest: float) -> Pieces:
    """Cut what is held; no substep takes longer than `longest` s."""
    parts = np.array([substeps(float(p), longest) for p in held.periods.max(axis=0)])
    h, push = held.periods.T / parts[:, None], held.push
    push = None if push is None else _samples_first(push)
    if not (laws.dynamic or laws.sensors.dynamic):
        one, ends = np.ones_like(parts), np.arange(len(parts))
        return Pieces(*_steadily(laws, held), push, h, parts, one, ends)
    of, ends = np.repeat(np.arange(len(parts)), parts), np.cumsum(parts) - 1
    first = np.diff(of, prepend=-1)
    u, on = _changing(laws, held, of, h) if laws.dynamic else _steadily(laws, held, of)
    return Pieces(u, on, None if push is None else push[of], h[of], np.ones_like(of), first, ends)


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
