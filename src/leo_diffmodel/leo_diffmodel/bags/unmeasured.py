# SPDX-License-Identifier: Apache-2.0
"""Rates and efforts that are in the messages and that nobody measured, joint by joint.

A driver that measures no rate or effort often leaves zeros, or what was in the memory. They
become NaN, not measured: the rate is then differentiated, the effort is no input of a motor.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
import math
from warnings import catch_warnings

import numpy as np
from numpy.typing import NDArray

from .states import Floats, StateLog

GARBAGE = 1e-300
"""N m, rad/s (N, m/s): what is smaller and not 0 is memory that nobody wrote, no sensor's."""
MOVES = 0.02
"""rad (m): what is more is a motion, above any encoder's resolution."""
FEWEST = 3
"""Values of an angle from which on it moves; two are a reset."""
JUMP = 20.0
"""Times the usual step: a reset, no motion."""
NO_INPUT = 'no measurement; taken as not measured, never as an input'
DIFFERENTIATED = 'differentiated from the positions'


def without_unmeasured(
    states: StateLog, lengths: Mapping[str, str], driven: Collection[str]
) -> tuple[StateLog, list[str]]:
    """Make NaN of rates and efforts that are no measurement; also say which, one line each.

    Args:
        states: as read, T of them.
        lengths: the columns' joints with the unit of their positions.
        driven: those whose motor moves them, so that 0 N m is no measurement.
    """
    moved = [
        f'{way:.2g} {unit}' for unit, way in zip(lengths.values(), _moved(states), strict=True)
    ]
    rates, told = _rates(states, list(lengths), moved)
    efforts, said = _efforts(states, list(lengths), moved, driven)
    told += said
    return (replace(states, dq=rates, effort=efforts), told) if told else (states, told)


def _rates(
    states: StateLog, joints: Sequence[str], moved: Sequence[str]
) -> tuple[Floats | None, list[str]]:
    """The rates that are measured; also which are not."""
    rates = states.dq
    if rates is None:
        return None, []
    missing = [name for j, name in enumerate(joints) if np.isnan(rates[:, j]).all()]
    told = [f'no velocities of {", ".join(missing)}; {DIFFERENTIATED}'] if missing else []
    still = _still_rates(states)
    told += [
        f'rates of {joints[j]} are {_constant(rates[0, j])} throughout while it moves by '
        f'{moved[j]}: no measurement; {DIFFERENTIATED}'
        for j in np.flatnonzero(still).tolist()
    ]
    return _emptied(rates, np.broadcast_to(still, rates.shape)), told


def _efforts(
    states: StateLog, joints: Sequence[str], moved: Sequence[str], driven: Collection[str]
) -> tuple[Floats | None, list[str]]:
    """The efforts that are measured; also which are not."""
    efforts = states.effort
    if efforts is None:
        return None, []
    garbage = _garbage(efforts)
    idle = _idle_efforts(states, joints, driven)
    told = [
        f'{n} efforts of {joints[j]} as {_example(efforts[:, j]):.2g}: memory that nobody wrote, '
        f'{NO_INPUT}'
        for j, n in enumerate(garbage.sum(axis=0))
        if n
    ]
    told += [
        f'efforts of {joints[j]} are 0 while it moves by {moved[j]}: {NO_INPUT}'
        for j in np.flatnonzero(idle).tolist()
    ]
    return _emptied(efforts, garbage | idle), told


def _emptied(values: Floats, out: NDArray[np.bool_]) -> Floats | None:
    """NaN where nothing was measured; None where nothing is left."""
    kept = np.where(out, np.nan, values)
    return None if np.isnan(kept).all() else kept


def _garbage(values: Floats) -> NDArray[np.bool_]:
    """Say which values of a channel (T, J) are too small for any; its zeros are no better."""
    tiny = (values != 0) & (np.abs(values) < GARBAGE)
    nothing_else = (tiny | (values == 0) | np.isnan(values)).all(axis=0) & tiny.any(axis=0)
    return np.asarray(tiny | (nothing_else & (values == 0)))


def _still_rates(states: StateLog) -> NDArray[np.bool_]:
    """Say of which joints (J,) the rate never changes, unlike their angle's."""
    dq = np.asarray(states.dq)
    rate = np.where(np.abs(dq) < GARBAGE, 0.0, dq)
    constant = (rate == rate[0]).all(axis=0)
    moves = _moved(states, np.where(constant, rate[0], 0.0)) > MOVES
    if not rate.any():  # of all joints: any change of any angle tells
        moves |= len(np.unique(states.q, axis=0)) >= FEWEST
    return np.asarray(constant & moves)


def _idle_efforts(
    states: StateLog, joints: Sequence[str], driven: Collection[str]
) -> NDArray[np.bool_]:
    """Say of which joints (J,) the motor says 0 throughout although they move."""
    effort = np.asarray(states.effort)
    zero = (effort == 0).all(axis=0) & (_moved(states) > MOVES)
    return np.asarray(zero & np.array([name in driven for name in joints]))


def _moved(states: StateLog, rates: Floats | float = 0.0) -> Floats:
    """How far each joint moves [rad, m] beside what constant rates make, without jumps (J,)."""
    q = states.q
    step = np.diff(q, axis=0) - rates * np.diff(states.stamp_ns)[:, None] * 1e-9
    step -= math.tau * np.round(step / math.tau)
    size = np.where(step != 0, np.abs(step), np.nan)
    with np.errstate(all='ignore'), catch_warnings(action='ignore'):
        usual = np.nan_to_num(np.nanmedian(size, axis=0))
    step[np.abs(step) > JUMP * usual] = 0.0
    way = np.ptp(np.vstack([np.zeros(q.shape[1]), np.cumsum(step, axis=0)]), axis=0)
    few = [len(np.unique(column)) < FEWEST for column in q.T]
    return np.where(few, 0.0, way)


def _constant(rate: float) -> str:
    return f'{rate if abs(rate) >= GARBAGE else 0:.3g}'


def _example(efforts: Floats) -> float:
    """The first value of a channel (T,) that is too small for any."""
    return float(efforts[(efforts != 0) & (np.abs(efforts) < GARBAGE)][0])
