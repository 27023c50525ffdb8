# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter


class StribeckFriction(Effect):
    """Stribeck friction: dry friction that is larger near rest."""

    name = 'stribeck_friction'
    family = 'friction'
    hook = 'torque'
    parameters = (
        Parameter('c', 'N m', low=0.0, role='amplitude', linear=False),
        Parameter('c_static', 'N m', low=0.0, above='c', role='amplitude', linear=False),
        Parameter('v_s', 'rad/s', low=0.0, role='shape'),
    )
    equation = 'tau = -(c + (c_static - c) exp(-(w / v_s)^2)) sign(w)'
    looks_like = 'Sticks, breaks loose with a jerk, then slides with less friction.'
    confused_with = (
        'coulomb_friction when no motion is slower than v_s; voltage_deadband near rest.'
    )
    reveal = 'Very slow reversals, so that many samples lie below and around v_s.'
    dry = True

    @staticmethod
    def law(
        c: float, c_static: float, v_s: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        level = c + (c_static - c) * np.exp(-((dq / np.maximum(v_s, 1e-9)) ** 2))
        return -np.copysign(level, dq)
