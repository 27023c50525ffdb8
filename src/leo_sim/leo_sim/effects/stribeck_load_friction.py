# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter


class StribeckLoadFriction(Effect):
    """Dry friction in proportion to the torque the gear transmits, larger near rest."""

    name = 'stribeck_load_friction'
    family = 'friction'
    hook = 'torque'
    parameters = (
        Parameter('mu', '', low=0.0, role='amplitude', linear=False),
        Parameter('mu_static', '', low=0.0, above='mu', role='amplitude', linear=False),
        Parameter('v_s', 'rad/s', low=0.0, role='shape'),
    )
    equation = 'tau = -(mu + (mu_static - mu) exp(-(w / v_s)^2)) |tau_motor - tau_load| sign(w)'
    looks_like = 'Under load it sticks and breaks loose with a jerk; without load it does not.'
    confused_with = (
        'load_dependent_friction, which it holds, when no motion is slower than v_s; '
        'stribeck_friction when the load hardly changes.'
    )
    reveal = 'Very slow reversals with and without payload.'
    dry = True
    uses_load = True

    @staticmethod
    def law(
        mu: float, mu_static: float, v_s: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        share = mu + (mu_static - mu) * np.exp(-((dq / np.maximum(v_s, 1e-9)) ** 2))
        return -np.copysign(share * np.abs(motor - load), dq)
