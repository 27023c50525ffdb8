# SPDX-License-Identifier: Apache-2.0
"""Dry friction that falls while the joint warms up: a trend over the time of a recording."""
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.effects.motor import Motor


class WarmingFriction(Effect):
    """Dry friction that falls while the joint warms up: a trend over the time of a recording.

    The memory is the time s since the recording began.
    """

    name = 'warming_friction'
    family = 'friction'
    hook = 'torque'
    parameters = (
        Parameter('c', 'N m', low=0.0, role='amplitude', linear=False),
        Parameter('c_cold', 'N m', low=0.0, above='c', role='amplitude', linear=False),
        Parameter('tau', 's', low=0.1, neutral=10.0, role='shape'),
    )
    equation = 'tau_f = -(c + (c_cold - c) exp(-t / tau)) sign(w)'
    looks_like = 'What a joint loses to dry friction falls from the start of a recording on.'
    confused_with = 'coulomb_friction, which it holds, in a recording shorter than tau.'
    reveal = 'A long run from cold that repeats one motion.'
    dry = True
    remembers = True
    timed = True

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None,
               memory: Any = 0.0) -> Any:
        """Torque at the joints, N m."""
        cold = np.exp(-memory / np.maximum(p['tau'], 1e-9))
        level = p['c'] + (p['c_cold'] - p['c']) * cold
        return -np.copysign(level, dq)

    def remember(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Any:
        """Time goes on."""
        return memory + dt
