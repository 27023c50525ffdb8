# SPDX-License-Identifier: Apache-2.0
"""Another simulator for the same laws: Runge-Kutta 4 with events, one state at a time.

Shares the laws and the tree with the other engines, but not the integration, the treatment of
dry friction (stick and slip phases, cut where a joint comes to rest) or of play (free and engaged
phases, cut where the play is used up). Data made with it do not flatter the model.
"""

from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.dynamics.inertia import answered, Dynamics, inverse_of
from leo_sim.dynamics.substep import DRIVE, Period, rested
from leo_sim.laws.laws import Laws, Memory

EVENTS = 6  # per substep
SWEEPS = 20
NEAR = 1e-12


class _Phase(NamedTuple):
    """What holds between two events."""

    sliding: np.ndarray  # direction of sliding per joint, 0 for a joint that sticks
    # -1, 0, 1 per joint: the edge of the play the motor side leans on, 0 = free
    engaged: np.ndarray


class _Motion(NamedTuple):
    """Angles and rates of joints, offset and rates of motor sides; also their derivatives."""

    q: Any
    dq: Any
    offset: Any
    speed: Any

    def along(self, change: Any, time: float) -> Any:
        """The state after moving along a derivative."""
        return _Motion(*(a + time * b for a, b in zip(self, change, strict=True)))


class _System:
    def __init__(
        self, laws: Laws, dynamics: Dynamics, u: Array, enabled: Any, memory: Memory, push: Numbers
    ):
        self.laws, self.dynamics, self.u, self.enabled = laws, dynamics, u, enabled
        self.memory, self.push = memory, push
        self.gap = np.zeros(len(laws.joints)) + (0.0 if laws.gap is None else laws.gap)

    def accelerations(self, y: _Motion, phase: _Phase) -> tuple[Any, Any, Any]:
        """Of joints and motor sides, and the torque each motor side passes on."""
        laws = self.laws
        mass, bias = self.dynamics.mass_and_bias(y.q, y.dq)
        load = self.dynamics.load(y.q) if laws.needs_load else None
        torques = laws.torques(y.q, y.dq, y.speed, self.u, self.enabled, load, self.memory)
        linked = (self.gap == 0) | (phase.engaged != 0)
        driving = np.where(linked, torques.motor, 0.0) + (torques.joint + self.push)
        inverse = inverse_of(mass, np.where(linked, laws.rotor_inertia, 0.0))
        free = driving - bias
        link = self._with_friction(inverse, free, torques.level, phase.sliding)
        inertia = np.maximum(laws.rotor_inertia, NEAR)
        rotor = np.where(linked, link, torques.motor / inertia)
        return link, rotor, torques.motor - laws.rotor_inertia * link

    def _with_friction(self, inverse: Array, free: Array, level: Any, sliding: Any) -> Any:
        """Accelerations with friction against sliding; sticking joints are held while it can."""
        if not self.laws.dry:
            return answered(inverse, free)
        torque = free - sliding * level
        held = np.zeros_like(free)
        sticking = np.flatnonzero((sliding == 0) & (level > 0)).tolist()
        for _ in range(SWEEPS if len(sticking) > 1 else len(sticking)):
            for j in sticking:
                now = answered(inverse, torque + held)[j]
                held[j] = np.clip(held[j] - now / inverse[j, j], -level[j], level[j])
        return answered(inverse, torque + held)

    def derivative(self, y: _Motion, phase: _Phase) -> _Motion:
        link, rotor, _ = self.accelerations(y, phase)
        return _Motion(y.dq, link, y.speed - y.dq, rotor)

    def advanced(self, y: _Motion, phase: _Phase, time: float) -> _Motion:
        a = self.derivative(y, phase)
        b = self.derivative(y.along(a, time / 2), phase)
        c = self.derivative(y.along(b, time / 2), phase)
        d = self.derivative(y.along(c, time), phase)
        dy = _Motion(*((w + 2 * x + 2 * z + v) / 6 for w, x, z, v in zip(a, b, c, d, strict=True)))
        return y.along(dy, time)

    def phase(self, y: _Motion) -> _Phase:
        geared = self.gap > 0
        edge = np.where(
            geared & (np.abs(y.offset) >= 0.5 * self.gap - NEAR) & (np.abs(y.speed - y.dq) < NEAR),
            np.sign(y.offset),
            0.0,
        )
        phase = _Phase(np.sign(y.dq), edge)
        if edge.any():
            passed = self.accelerations(y, phase)[2]
            phase = phase._replace(engaged=np.where(passed * edge > 0, edge, 0.0))
        return phase

    def first_event(self, y: _Motion, after: _Motion, phase: _Phase) -> tuple[float, Any, Any]:
        """Fraction of the step to the first event, joints that stop, joints whose play ends."""
        stops = (phase.sliding * after.dq < 0) & self.laws.dry
        over = (np.abs(after.offset) - 0.5 * self.gap) * (self.gap > 0)
        ends = (over > NEAR) & (phase.engaged == 0)
        fraction = np.ones_like(y.q)
        fraction = np.where(stops, y.dq / np.where(stops, y.dq - after.dq, 1.0), fraction)
        edge = np.sign(after.offset) * 0.5 * self.gap
        moved = np.where(ends, after.offset - y.offset, 1.0)
        fraction = np.where(ends, np.minimum(fraction, (edge - y.offset) / moved), fraction)
        first = float(fraction.min())
        return first, stops & (fraction <= first), ends & (fraction <= first)


def integrate(
    laws: Laws, dynamics: Dynamics, q: Array, dq: Array, memory: Memory, period: Period
) -> tuple[Any, Any, Memory]:
    """As `substep.integrate`."""
    inputs, enabled, h, count, push = period
    memory = rested(laws, q, dq, memory)
    offset, speed = memory[DRIVE] if laws.gap is not None else (np.zeros_like(q), dq)
    y = _Motion(q, dq, offset, speed)
    for _ in range(count):
        u, on, memory = laws.command(inputs, enabled, memory, h)
        y = _step(_System(laws, dynamics, u, on, memory, push), y, h)
        if laws.remembers:
            memory = laws.remember(y.q, y.dq, memory, h)
    if laws.gap is not None:
        memory = {**memory, DRIVE: np.stack([y.offset, y.speed])}
    return y.q, y.dq, memory


def _step(system: _System, y: _Motion, h: float) -> _Motion:
    left = h
    for _ in range(EVENTS):
        phase = system.phase(y)
        after = system.advanced(y, phase, left)
        fraction, stops, ends = system.first_event(y, after, phase)
        if not (stops.any() or ends.any()):
            return _locked(system, after, phase)
        y = _locked(system, system.advanced(y, phase, fraction * left), phase)
        y = y._replace(dq=np.where(stops, 0.0, y.dq))
        y = _struck(system, y, ends)
        left *= 1.0 - fraction
    return _locked(system, system.advanced(y, system.phase(y), left), system.phase(y))


def _locked(system: _System, y: _Motion, phase: _Phase) -> _Motion:
    """Sticking joints at rest, motor sides without free play moving with their joints."""
    linked = (system.gap == 0) | (phase.engaged != 0)
    edge = np.where(system.gap > 0, phase.engaged * 0.5 * system.gap, 0.0)
    speed, offset = np.where(linked, y.dq, y.speed), np.where(linked, edge, y.offset)
    return y._replace(speed=speed, offset=offset)


def _struck(system: _System, y: _Motion, ends: Any) -> _Motion:
    """After inelastic impacts where the play of a joint ends."""
    dq, speed = y.dq, y.speed
    for j in np.flatnonzero(ends).tolist():
        mass, _ = system.dynamics.mass_and_bias(y.q, dq)
        diagonal = np.where(system.gap == 0, system.laws.rotor_inertia, 0.0)
        answer = inverse_of(mass, diagonal)[j]
        rotor = (system.laws.rotor_inertia + np.zeros_like(dq))[j]
        impulse = (speed[j] - dq[j]) / (1.0 / rotor + answer[j])
        dq = dq + answer * impulse
        speed = np.where(np.arange(len(dq)) == j, dq[j], speed)
    edge = np.sign(y.offset) * 0.5 * system.gap
    return y._replace(dq=dq, speed=speed, offset=np.where(ends, edge, y.offset))
