# SPDX-License-Identifier: Apache-2.0

from typing import Any

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Reading, Values


class EncoderOffset(Effect):
    """The measured angle is the true one + o."""

    name = 'encoder_offset'
    family = 'sensor'
    hook = 'sensor'
    parameters = (Parameter('o', 'rad', role='amplitude'),)
    equation = 'q_read = q + o'
    looks_like = 'Gravity seems turned: the rest position is not where it should be.'
    confused_with = 'bias_torque over narrow angles; link_com x.'
    reveal = 'Hanging still, and slow motion over a full turn.'

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        return q + p['o'], dq, memory
