# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect, Parameter


class DirectionalLoadFriction(Effect):
    """Dry friction under load that differs with the direction in which power flows."""

    name = 'directional_load_friction'
    family = 'friction'
    hook = 'torque'
    parameters = (
        Parameter('mu', '', low=0.0, role='amplitude', linear=False),
        Parameter('mu_back', '', low=0.0, role='amplitude', linear=False),
    )
    equation = (
        'tau = -mu |tau_motor - tau_load| sign(w) where the motor drives (tau_motor w > 0)'
        ', mu_back in place of mu where the load drives'
    )
    looks_like = 'Lifting costs another share of the torque than lowering the same weight.'
    confused_with = (
        'load_dependent_friction, which it holds, where the motor always drives; '
        'torque_scale where it always lifts.'
    )
    reveal = 'Lift and lower the same weight, at the same speeds.'
    dry = True
    uses_load = True

    @staticmethod
    def law(
        mu: float, mu_back: float, _: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        """Torque at the joint, N m; of a joint at rest, against the motion that would begin."""
        way = np.where(dq == 0.0, motor + load, dq)
        share = np.where(motor * way > 0.0, mu, mu_back)
        return -np.copysign(share * np.abs(motor - load), dq)

    def places(self, robot: Robot) -> tuple[str, ...]:
        return tuple(actuator.joint for actuator in robot.actuators)
