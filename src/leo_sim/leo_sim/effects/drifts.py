# SPDX-License-Identifier: Apache-2.0
"""Effects at a joint that grow or fade while a robot runs."""

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array
from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.effects.motor import Motor

SETTLES = Parameter('T', 's', neutral=5.0, low=0.1, role='shape')


class _Drift(Effect):
    hook = 'torque'
    steady = True
    remembers = True
    timed = True

    def left(self, p: Values, time: Any) -> Any:
        """The share of a change that is still to come."""
        return np.exp(-time / np.maximum(p['T'], 1e-9))

    def places(self, robot: Robot) -> tuple[str, ...]:
        """Not of a walker, whose runs take seconds."""
        return () if robot.contacts else super().places(robot)


class WarmingFriction(_Drift):
    """Dry friction that goes from one level to another, as of grease that warms up."""

    name = 'warming_friction'
    family = 'friction'
    parameters = (
        Parameter('c', 'N m', low=0.0, role='amplitude', linear=False),
        Parameter('c_start', 'N m', low=0.0, role='amplitude', linear=False),
        SETTLES,
    )
    equation = 'tau = -(c + (c_start - c) exp(-t / T)) sign(w), t from the start of the run'
    looks_like = 'The same motion loses more, or less, in the first seconds of each run.'
    confused_with = 'coulomb_friction, which it holds, in runs that are short or warm.'
    reveal = 'The same motion for some minutes, from cold.'
    dry = True

    def torque(
        self, p: Values, q: Array, dq: Array, motor: Motor, load: Any, memory: Any = 0.0
    ) -> Any:
        level = p['c'] + (p['c_start'] - p['c']) * self.left(p, memory)
        return -np.copysign(level, dq)


class TorqueFade(_Drift):
    """The net motor torque loses the share s over time: a warm winding, a supply that sags."""

    name = 'torque_fade'
    family = 'motor'
    parameters = (Parameter('s', '', high=1.0, role='amplitude'), SETTLES)
    equation = 'tau = -s (1 - exp(-t / T)) tau_motor, t from the start of the run'
    looks_like = 'Everything the motor does gets weaker the longer a run takes.'
    confused_with = 'torque_scale where all runs are long or short; warming_friction.'
    reveal = 'The same motion for some minutes, from cold and with a full supply.'
    motor_side = True
    rank = 30

    def torque(
        self, p: Values, q: Array, dq: Array, motor: Motor, load: Any, memory: Any = 0.0
    ) -> Any:
        return -p['s'] * (1.0 - self.left(p, memory)) * motor.torque
