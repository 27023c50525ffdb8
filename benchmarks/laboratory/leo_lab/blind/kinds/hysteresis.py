# SPDX-License-Identifier: Apache-2.0
"""Friction that builds up over a distance, as in a seal or a tensioned belt (Dahl 1968)."""

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter, Values


class Hysteresis(Effect):
    """Dahl's friction: -c z, where z follows the direction of motion over `reach`."""

    name = 'hysteresis'
    family = 'outside'
    hook = 'torque'
    parameters = (Parameter('c', 'N m', low=0.0), Parameter('reach', 'rad', neutral=0.3, low=1e-3))
    remembers = True

    def torque(self, p: Values, q: Any, dq: Any, motor: Any, load: Any, memory: Any = None) -> Any:
        """Torque on the joint; the memory is z, from -1 to 1."""
        return -p['c'] * (0.0 if memory is None else memory) + 0.0 * q

    def remember(self, p: Values, q: Any, dq: Any, memory: Any, dt: Any) -> Any:
        """The state z after dt s; exact while the direction holds."""
        before = 0.0 if memory is None else memory
        way = np.sign(dq)
        return way + (before - way) * np.exp(-np.abs(dq) * dt / p['reach'])
