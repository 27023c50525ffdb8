# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.effects.motor import Motor


class CoulombFriction(Effect):
    """Coulomb friction: a constant torque c against motion, holding still below c."""

    name = 'coulomb_friction'
    family = 'friction'
    hook = 'torque'
    parameters = (Parameter('c', 'N m', low=0.0, role='amplitude', linear=False),)
    equation = 'tau = -c sign(w); holds still while the other torques stay below c'
    looks_like = (
        'Amplitudes shrink by the same amount each swing; small torques do not start a motion.'
    )
    confused_with = (
        'voltage_deadband where the joint hardly moves; viscous_friction over a '
        'narrow range of speed.'
    )
    reveal = (
        'Slow triangles and free swings that come to rest: the missing torque is a step at'
        ' zero speed.'
    )
    dry = True
    steady = True

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return -np.copysign(p['c'], dq)
