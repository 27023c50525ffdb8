# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter


class TorqueRipple(Effect):
    """Torque ripple: a sin(n q + phase), cogging of motor or gear."""

    name = 'torque_ripple'
    family = 'motor'
    hook = 'torque'
    parameters = (
        Parameter('a', 'N m', low=0.0, role='amplitude'),
        Parameter('n', '1/turn', low=0.0, whole=True, role='shape'),
        Parameter('phase', 'rad', role='phase'),
    )
    equation = 'tau = a sin(n q + phase)'
    looks_like = 'A missing torque that repeats n times per turn, whatever the speed.'
    confused_with = 'link_mass and external_force for n = 1; encoder_scale.'
    reveal = 'Slow motion over full turns, both ways.'

    @staticmethod
    def law(
        a: float, n: float, phase: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        return a * np.sin(n * q + phase)
