# SPDX-License-Identifier: Apache-2.0
"""A torque that comes and goes with time, whatever the robot does."""

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter, Values


class PeriodicTorque(Effect):
    """A torque that comes and goes with time: a sin(2 pi f t + phase)."""

    name = 'periodic_torque'
    family = 'outside'
    hook = 'torque'
    parameters = (Parameter('a', 'N m'), Parameter('f', 'Hz', low=0.0), Parameter('phase', 'rad'))
    remembers = True
    timed = True

    def torque(self, p: Values, q: Any, dq: Any, motor: Any, load: Any, memory: Any = 0.0) -> Any:
        """Torque on the joint; the memory is the time."""
        return p['a'] * np.sin(2 * np.pi * p['f'] * memory + p['phase']) + 0.0 * q

    def remember(self, p: Values, q: Any, dq: Any, memory: Any, dt: Any) -> Any:
        """Time goes on."""
        return memory + dt
