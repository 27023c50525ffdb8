# SPDX-License-Identifier: Apache-2.0
"""Rates and efforts that are in the messages and that nobody measured.

A driver that measures no rate or effort often leaves zeros, or what was in the memory. They
become NaN, not measured: the rate is then differentiated, the effort is no input of a motor.

Other rates are made from the positions. What a joint does is smooth; what differs from sample to
sample is noise of the sensor, or its steps. A speed that repeats the noise of the differences of
the angle, and not only the motion, is those differences.
"""

from collections.abc import Collection, Sequence
import math
from warnings import catch_warnings

import numpy as np
from numpy.typing import NDArray

from leo_sim.description.robot import Robot

from .impossible import lengths
from .states import StateLog
from .topic_map import TopicMap
from .types import Floats, Stamps

GARBAGE = 1e-300  # N m, rad/s (N, m/s): less, and not 0, is memory that nobody wrote
MOVES = 0.02  # rad (m): what is more is a motion, above any encoder's resolution
FEWEST = 3  # values of an angle from which on it moves; two are a reset
JUMP = 20.0  # times the usual step: a reset, no motion
ALIKE = 0.02  # of the roughness of a difference: what a speed that is made of it may be off by
ROUGH = 1e-4  # of the speed: smoother ones have no noise to know them by
MOST = 0.9
FEWEST_ROUGH = 20
NO_INPUT = 'no measurement; taken as not measured, never as an input'
DIFFERENTIATED = 'differentiated from the positions'


def without_unmeasured(states: StateLog, robot: Robot, topic_map: TopicMap) -> StateLog:
    """Make NaN of rates and efforts that are no measurement.

    0 N m is one where no motor moves the joint, or where the topic map takes it for the input.
    """
    units = lengths(robot)
    moved = [f'{way:.2g} {u}' for u, way in zip(units.values(), _moved(states), strict=True)]
    driven = set() if topic_map.input == 'effort' else {a.joint for a in robot.actuators}
    rates, of_rates = _rates(states, list(units), moved)
    efforts, of_efforts = _efforts(states, list(units), moved, driven)
    notes = of_rates + of_efforts
    return states.noted(notes, dq=rates, effort=efforts) if notes else states


def _rates(
    states: StateLog, joints: Sequence[str], moved: Sequence[str]
) -> tuple[Floats | None, list[str]]:
    rates = states.dq
    if rates is None:
        return None, []
    missing = [name for name, rate in zip(joints, rates.T, strict=True) if np.isnan(rate).all()]
    notes = [f'no velocities of {", ".join(missing)}; {DIFFERENTIATED}'] if missing else []
    written = np.where(np.abs(rates) < GARBAGE, 0.0, rates)
    first, constant = written[0], (written == written[0]).all(axis=0)
    moves = _moved(states, np.where(constant, first, 0.0)) > MOVES
    if not written.any():  # of all joints: any change of any angle shows it
        moves |= len(np.unique(states.q, axis=0)) >= FEWEST
    still = constant & moves
    notes += [
        f'rates of {joints[j]} are {first[j]:.3g} throughout while it moves by {moved[j]}: no '
        f'measurement; {DIFFERENTIATED}'
        for j in np.flatnonzero(still).tolist()
    ]
    return _emptied(rates, np.broadcast_to(still, rates.shape)), notes


def _efforts(
    states: StateLog, joints: Sequence[str], moved: Sequence[str], driven: Collection[str]
) -> tuple[Floats | None, list[str]]:
    efforts = states.effort
    if efforts is None:
        return None, []
    tiny = (efforts != 0) & (np.abs(efforts) < GARBAGE)
    nothing_else = (tiny | (efforts == 0) | np.isnan(efforts)).all(axis=0) & tiny.any(axis=0)
    garbage = tiny | (nothing_else & (efforts == 0))  # zeros beside nothing else are no better
    zero = (efforts == 0).all(axis=0) & (_moved(states) > MOVES)
    idle = zero & np.array([name in driven for name in joints])
    notes = [
        f'{garbage[:, j].sum()} efforts of {joints[j]} as {efforts[tiny[:, j], j][0]:.2g}: memory '
        f'that nobody wrote, {NO_INPUT}'
        for j in np.flatnonzero(tiny.any(axis=0)).tolist()
    ]
    notes += [
        f'efforts of {joints[j]} are 0 while it moves by {moved[j]}: {NO_INPUT}'
        for j in np.flatnonzero(idle).tolist()
    ]
    return _emptied(efforts, garbage | idle), notes


def _emptied(values: Floats, out: NDArray[np.bool_]) -> Floats | None:
    kept = np.where(out, np.nan, values)
    return None if np.isnan(kept).all() else kept


def _moved(states: StateLog, rates: Floats | float = 0.0) -> Floats:
    """How far each joint moves [rad, m] besides what constant rates make, without jumps (J,)."""
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


def without_made_rates(states: StateLog, *_: object) -> StateLog:
    """Leave out velocities that are differences of the positions."""
    if states.dq is None:
        return states
    there = np.isfinite(states.dq).all(axis=0)
    with np.errstate(all='ignore'):  # whatever numbers a bag holds
        found = made_from(states.stamp_ns, states.q[:, there], states.dq[:, there])
    note = f'the velocities are {found} differences of the positions; differentiated anew'
    return states.noted([note], dq=None, made=True) if found else states


def made_from(stamp_ns: Stamps, q: Floats, dq: Floats) -> str:
    """Return which difference of the positions (T, J) the velocities (T, J) are; '' for none.

    All joints that say something must agree: those whose differences are rough in 20 samples.
    """
    if len(q) < FEWEST_ROUGH or not (np.diff(stamp_ns) > 0).all():
        return ''
    t = (stamp_ns - stamp_ns[0]) * 1e-9
    step, middle = np.diff(q, axis=0) / np.diff(t)[:, None], (t[1:] + t[:-1]) / 2
    central = np.gradient(q, t, axis=0)
    ways = {
        'backward': (middle[:-1], step[:-1]),
        'forward': (middle[1:], step[1:]),
        'central': (t[1:-1], central[1:-1]),
    }
    found = (way for way, (at, difference) in ways.items() if _repeats(at, difference, dq[1:-1]))
    return next(found, '')


def _repeats(at: Floats, difference: Floats, dq: Floats) -> bool:
    """Say whether velocities are a difference to a small part of its roughness.

    Times `at` of the differences [s] have shape (N,), the others (N, J) [rad/s].
    """
    slope = np.diff(difference, axis=0) / np.diff(at)[:, None]
    rough = np.abs(np.diff(slope, axis=0)) * (at[2:] - at[:-2])[:, None] / 2
    off = np.abs(dq - difference)[1:-1]
    moved = rough > ROUGH * np.sqrt(np.mean(np.square(dq), axis=0))
    shares = [
        (off[rows, j] <= ALIKE * np.median(rough[rows, j])).mean()
        for j, rows in enumerate(moved.T)
        if rows.sum() >= FEWEST_ROUGH
    ]
    return bool(shares) and min(shares) >= MOST
