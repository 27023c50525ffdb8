# SPDX-License-Identifier: Apache-2.0
"""One sample period of a model: position Verlet, with dry friction, play and stops as impulses.

Per substep h: drift q by h/2, kick dq by the torques there, drift by h/2 (second order). Torques
that fall linearly with speed are taken at the mean of the rates before and after the kick, which
keeps second order and stays stable with stiff motors; Coriolis and centrifugal ones at a mean
predicted with those before it. The same code drives every body.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, paired
from leo_sim.dynamics.impulses import Contact, settled, STILL, stopped
from leo_sim.dynamics.inertia import Dynamics
from leo_sim.laws.laws import Laws, Memory

DRIVE = 'drive'
PROBE = 1e-3  # rad/s, to differentiate the torques by speed


class Drag(NamedTuple):
    """Falling of the motor and of the joint torques with speed, N m s/rad, (..., J)."""

    motor: Any
    joint: Any


class Period(NamedTuple):
    """What is held over so many steps of h s."""

    inputs: Any  # V, N m or rad, (..., A)
    enabled: Any  # booleans (..., A), or None for all
    h: Any  # s: a float, or an array that broadcasts with the angles
    steps: int
    push: Any = 0.0  # extra torque on the links, N m, (..., J)


def slowing(
    laws: Laws, dynamics: Dynamics, q: Array, dq: Array, memory: Memory, u: Array, enabled: Any
) -> Drag:
    """Derivative of the smooth torques by speed, once per sample period."""
    load = dynamics.load(q) if laws.needs_load else None
    here = laws.torques(q, dq, dq, u, enabled, load, memory)
    faster = laws.torques(q, dq + PROBE, dq + PROBE, u, enabled, load, memory)
    return Drag((here.motor - faster.motor) / PROBE, (here.joint - faster.joint) / PROBE)


def kick(
    laws: Laws, dynamics: Dynamics, q: Array, dq: Array, memory: Memory, given: Any, drag: Drag
) -> tuple[Any, Memory]:
    """Rates (..., J) after one kick at the angles q, and the new memory.

    Given are the inputs at the motors, those enabled, h s, and the extra torque; see `Period`.
    """
    u, enabled, h, push = given
    load = dynamics.load(q) if laws.needs_load else None
    offset, motor_speed = memory[DRIVE] if laws.gap is not None else (None, dq)
    torques = laws.torques(q, dq, motor_speed, u, enabled, load, memory)
    rotor = laws.rotor_inertia + (0.5 * h) * drag.motor
    geared, driving = rotor, torques.motor
    if laws.gap is not None:
        geared, driving = (np.where(laws.gap > 0, 0.0, f) for f in (rotor, torques.motor))
        rotor = np.where(laws.gap > 0, rotor, 1.0)
    driving = driving + (torques.joint + push)
    held = (
        driving
        if torques.level is None
        else driving - np.sign(dq) * (np.abs(dq) > STILL) * torques.level
    )
    rates, inverse = dynamics.kicked(q, dq, geared + (0.5 * h) * drag.joint, driving, held, h)
    if torques.level is None and laws.stops is None and laws.gap is None:
        return rates, memory
    low, high = laws.stops or (-np.inf, np.inf)
    free = None if laws.gap is None else motor_speed + h * torques.motor / rotor
    if torques.level is None and laws.gap is None and not stopped(low, high, q, rates, h):
        return rates, memory
    level = 0.0 if torques.level is None else torques.level
    gap, side, slip = (0.0, 1.0, 0.0) if laws.gap is None else (laws.gap, rotor, offset)
    contact = Contact(level, low, high, gap, side, slip, q, dq)
    rates, motor_speed = settled(contact, inverse, h, rates, free)
    if laws.gap is not None:
        motor_speed = np.where(laws.gap > 0, motor_speed, rates)
        slip = offset + h * (motor_speed - rates)
        memory = {**memory, DRIVE: paired(slip, motor_speed)}
    return rates, memory


def integrate(
    laws: Laws, dynamics: Dynamics, q: Array, dq: Array, memory: Memory, period: Period
) -> tuple[Any, Any, Memory]:
    """The state after a period, of true angles and rates (..., J)."""
    inputs, enabled, h, count, push = period
    memory = rested(laws, q, dq, memory)
    u, on, memory = laws.command(inputs, enabled, memory, h)
    drag = slowing(laws, dynamics, q, dq, memory, u, on)
    q = q + 0.5 * h * dq
    dynamics.begin(q, dq, h)
    for i in range(count):
        if i and laws.dynamic:
            u, on, memory = laws.command(inputs, enabled, memory, h)
        faster, memory = kick(laws, dynamics, q, dq, memory, (u, on, h, push), drag)
        q, dq = dynamics.move(q, dq, faster, h)
        if laws.remembers:
            memory = laws.remember(q - 0.5 * h * dq, dq, memory, h)
    return q - 0.5 * h * dq, dq, memory


def rested(laws: Laws, q: Array, dq: Array, memory: Memory) -> Memory:
    """The memory; where it says nothing, motors are amid their play and sensors have settled."""
    if laws.sensors.dynamic:
        memory = laws.sensors.sense(q, dq, memory, 0.0)[2]
    if laws.gap is None or DRIVE in memory:
        return memory
    return {**memory, DRIVE: np.stack([np.zeros_like(dq), dq])}


def substeps(dt: float, longest: float) -> int:
    """How many equal substeps no longer than `longest` s make up dt s."""
    return max(1, math.ceil(dt / longest - 1e-9))
