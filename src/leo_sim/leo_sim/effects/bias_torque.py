# SPDX-License-Identifier: Apache-2.0

from typing import Any

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.effects.motor import Motor


class BiasTorque(Effect):
    """A constant torque t."""

    name = 'bias_torque'
    family = 'load'
    hook = 'torque'
    parameters = (Parameter('t', 'N m', role='amplitude'),)
    equation = 'tau = t'
    looks_like = 'One direction is easier than the other at every angle.'
    confused_with = 'encoder_offset and external_force while the angle stays in a narrow range.'
    reveal = 'Slow motion over the full turn: a bias stays constant, gravity terms change sign.'
    steady = True

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return p['t'] + 0.0 * q
