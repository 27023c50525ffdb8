# SPDX-License-Identifier: Apache-2.0
"""The angle comes in steps that are coarse against the motion."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.faults.base import Array, Fault


class Quantised(Fault):
    """The angle comes in steps that are coarse against the motion."""

    name = 'quantised'
    channel = 'angle'
    unit = 'rad'
    law = 'q_log = step round(q / step)'
    harmless = (0.0, 0.02)
    """rad."""
    harmless_words = '0.02 rad, or a fiftieth of the range moved through where that is less'
    looks_like = 'Few different values, all multiples of one.'
    confused_with = 'Noise; backlash.'
    costs = 'Speeds that are differences of it are noise.'
    todo = 'log more digits, or the counts of the encoder'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return np.asarray(value * np.round(x / value))
