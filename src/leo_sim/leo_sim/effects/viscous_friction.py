# SPDX-License-Identifier: Apache-2.0

from typing import Any

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.effects.motor import Motor


class ViscousFriction(Effect):
    """Viscous friction: a torque -b w against the joint speed."""

    name = 'viscous_friction'
    family = 'friction'
    hook = 'torque'
    parameters = (Parameter('b', 'N m s/rad', low=0.0, role='amplitude'),)
    equation = 'tau = -b w'
    looks_like = (
        'Motion dies out faster than the model says, in proportion to speed; nothing at rest.'
    )
    confused_with = 'back_emf_scale on a voltage-driven joint that is never free: the same torque.'
    reveal = 'Let it swing with the motors free: back-EMF is gone then, viscous friction is not.'
    steady = True

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return -p['b'] * dq
