# SPDX-License-Identifier: Apache-2.0

from typing import Any

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.effects.motor import Motor


class TorqueScale(Effect):
    """The net motor torque is k times the model's, back-EMF included."""

    name = 'torque_scale'
    family = 'motor'
    hook = 'torque'
    parameters = (Parameter('k', '', neutral=1.0, low=0.0, role='amplitude'),)
    equation = 'tau = (k - 1) tau_motor, back-EMF included'
    looks_like = 'Everything the motor does, pushing and braking, is stronger or weaker.'
    confused_with = (
        'voltage_scale (the same on a torque-driven joint, or where the torque '
        'constant is refitted).'
    )
    reveal = (
        'Runs with the motors shorted (0 V): braking changes with torque_scale, not with '
        'voltage_scale.'
    )
    motor_side = True
    steady = True
    rank = 20

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return (p['k'] - 1.0) * motor.torque
