# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Values


class ActuatorLag(Effect):
    """The motor input follows the command as a first-order lag of time constant tau."""

    name = 'actuator_lag'
    family = 'command'
    hook = 'command'
    parameters = (Parameter('tau', 's', low=0.0, high=1.0, role='delay'),)
    equation = 'tau du_motor/dt = u - u_motor'
    looks_like = 'Steps of the command arrive rounded.'
    confused_with = 'command_delay, above all with slow sampling; armature.'
    reveal = 'Steps and fast square waves, sampled at 100 Hz or more.'
    dynamic = True
    rank = 50

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        before = np.zeros_like(u) if memory is None else memory
        steps = dt / np.maximum(p['tau'], 1e-200)
        decay = np.exp(-steps)
        mean = u + (before - u) * ((1.0 - decay) / steps)
        return mean, u + (before - u) * decay
