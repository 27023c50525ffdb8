# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter


class QuadraticDrag(Effect):
    """Quadratic drag: a torque -d w |w|, as of air."""

    name = 'quadratic_drag'
    family = 'friction'
    hook = 'torque'
    parameters = (Parameter('d', 'N m s2/rad2', low=0.0, role='amplitude'),)
    equation = 'tau = -d w |w|'
    looks_like = 'Little loss in slow motion, strong loss at the highest speeds.'
    confused_with = 'viscous_friction and back_emf_scale when the speed range is narrow.'
    reveal = 'Free swings from large and from small angles.'

    @staticmethod
    def law(d: float, _a: float, _b: float, q: float, dq: float, motor: float, load: float) -> Any:
        return -d * dq * np.abs(dq)
