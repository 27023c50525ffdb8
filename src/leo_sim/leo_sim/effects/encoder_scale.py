# SPDX-License-Identifier: Apache-2.0

from typing import Any

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Reading, Values


class EncoderScale(Effect):
    """The measured angle and rate are the true ones x k."""

    name = 'encoder_scale'
    family = 'sensor'
    hook = 'sensor'
    parameters = (Parameter('k', '', neutral=1.0, low=0.1, high=10.0, role='amplitude'),)
    equation = 'q_read = k q, w_read = k w'
    looks_like = 'Gravity repeats not once per measured turn; swings seem wider or narrower.'
    confused_with = 'link_mass, link_inertia and torque_scale together, over narrow angles.'
    reveal = 'Slow motion over a full turn or more.'
    rank = 20

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        return q * p['k'], dq * p['k'], memory
