# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter


class QuadraticLoadFriction(Effect):
    """Dry friction that grows faster than the torque the gear transmits."""

    name = 'quadratic_load_friction'
    family = 'friction'
    hook = 'torque'
    parameters = (
        Parameter('mu', '', low=0.0, role='amplitude', linear=False),
        Parameter('mu2', '1/N m', low=0.0, role='amplitude', linear=False),
    )
    equation = 'tau = -(mu T + mu2 T^2) sign(w), T = |tau_motor - tau_load|'
    looks_like = 'Dry friction that takes a larger share of the torque the more there is of it.'
    confused_with = 'load_dependent_friction, which it holds, while the loads are alike.'
    reveal = 'The same motion with a light, a middle and a heavy payload.'
    dry = True
    uses_load = True

    @staticmethod
    def law(
        mu: float, mu2: float, _: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        carried = np.abs(motor - load)
        return -np.copysign(mu * carried + mu2 * carried * carried, dq)
