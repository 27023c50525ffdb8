# SPDX-License-Identifier: Apache-2.0
"""The angle comes in steps that are coarse against the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault


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

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """Round the angle."""
        q = e.q.copy()
        q[:, j] = value * np.round(q[:, j] / value)
        return replace(e, q=q)

    def todo(self, value: float) -> str:
        """What to do."""
        return 'log more digits, or the counts of the encoder'
