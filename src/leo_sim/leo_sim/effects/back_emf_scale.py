# SPDX-License-Identifier: Apache-2.0

from typing import Any

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.effects.motor import Motor


class BackEmfScale(Effect):
    """Back-EMF is k times the model's."""

    name = 'back_emf_scale'
    family = 'motor'
    hook = 'torque'
    parameters = (Parameter('k', '', neutral=1.0, low=0.0, role='amplitude'),)
    equation = 'tau = (k - 1) tau_emf'
    looks_like = 'Damping while the motors are on differs; the stall torque is right.'
    confused_with = (
        'viscous_friction on a voltage-driven joint that is never free: the same torque.'
    )
    reveal = 'Let it swing with the motors free: only friction is left then.'
    motor_side = True
    steady = True
    rank = 10

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return (p['k'] - 1.0) * motor.back_emf

    def places(self, robot: Robot) -> tuple[str, ...]:
        return super().places(robot) if robot.has_motor_law else ()
