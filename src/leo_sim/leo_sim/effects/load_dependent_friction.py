# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter


class LoadDependentFriction(Effect):
    """Dry friction in proportion to the torque the gear transmits."""

    name = 'load_dependent_friction'
    family = 'friction'
    hook = 'torque'
    parameters = (Parameter('mu', '', low=0.0, role='amplitude', linear=False),)
    equation = 'tau = -mu |tau_motor - tau_load| sign(w)'
    looks_like = (
        'Dry friction that grows with the torque through the gear: strong under load, '
        'weak when idle.'
    )
    confused_with = (
        'coulomb_friction when the load hardly changes; torque_scale while driving '
        'in one direction.'
    )
    reveal = 'The same motion with and without payload, and driving with and against gravity.'
    dry = True
    uses_load = True

    @staticmethod
    def law(
        mu: float, _a: float, _b: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        return -np.copysign(mu * np.abs(motor - load), dq)
