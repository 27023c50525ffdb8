# SPDX-License-Identifier: Apache-2.0
"""Dry friction that is larger in one direction than in the other."""

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter, Values


class AsymmetricFriction(Effect):
    """Coulomb friction c (1 + skew) against positive rates, c (1 - skew) against negative ones."""

    name = 'asymmetric_friction'
    family = 'outside'
    hook = 'torque'
    parameters = (Parameter('c', 'N m', low=0.0), Parameter('skew', '', low=-1.0, high=1.0))
    dry = True

    def torque(self, p: Values, q: Any, dq: Any, motor: Any, load: Any) -> Any:
        """Torque at the joints, N m."""
        return -p['c'] * (np.copysign(1.0, dq) + p['skew'])
