# SPDX-License-Identifier: Apache-2.0
"""A cable that pulls one way: slack up to an angle, a spring beyond it."""

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter, Values


class Cable(Effect):
    """A one-sided spring: -side k max(0, side (q - slack))."""

    name = 'cable'
    family = 'outside'
    hook = 'torque'
    parameters = (
        Parameter('k', 'N m/rad', low=0.0),
        Parameter('slack', 'rad'),
        Parameter('side', '', neutral=1.0),
    )

    def torque(self, p: Values, q: Any, dq: Any, motor: Any, load: Any) -> Any:
        """Torque on the joint."""
        return -p['side'] * p['k'] * np.maximum(0.0, p['side'] * (q - p['slack']))
