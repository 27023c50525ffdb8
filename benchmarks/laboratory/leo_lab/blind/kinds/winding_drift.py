# SPDX-License-Identifier: Apache-2.0
"""The motor weakens while its winding warms up."""

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter, Values


class WindingDrift(Effect):
    """Resistance that rises by the share `rise` with the time constant tau: less torque."""

    name = 'winding_drift'
    family = 'outside'
    hook = 'torque'
    parameters = (Parameter('rise', '', low=0.0), Parameter('tau', 's', neutral=10.0, low=0.1))
    motor_side = True
    remembers = True
    timed = True

    def torque(self, p: Values, q: Any, dq: Any, motor: Any, load: Any, memory: Any = 0.0) -> Any:
        """What the motor has lost since it was cold; the memory is the time."""
        warm = p['rise'] * (1.0 - np.exp(-memory / p['tau']))
        return (1.0 / (1.0 + warm) - 1.0) * motor.torque

    def remember(self, p: Values, q: Any, dq: Any, memory: Any, dt: Any) -> Any:
        """Time goes on."""
        return memory + dt
