# SPDX-License-Identifier: Apache-2.0
"""The speed is not zero where the joint stands."""

from __future__ import annotations

from dataclasses import replace

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault, Patch


class SpeedZero(Fault):
    """The speed is not zero where the joint stands."""

    name = 'speed_zero'
    channel = 'speed'
    unit = 'rad/s'
    law = 'w = dq/dt + b'
    harmless = (-0.02, 0.02)
    """Of how fast the joint moves (rms)."""
    harmless_words = 'a fiftieth of the rms speed; a step of the sensor, which may round down'
    looks_like = 'The sum of the speeds runs away from the angle, evenly.'
    confused_with = 'speed_scale where the joint turns one way only.'
    costs = 'A constant torque or a tilt of the base is named that is not there.'

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """Add it to the speed."""
        dq = e.dq.copy()
        dq[:, j] += value
        return replace(e, dq=dq)

    def patch(self, value: float) -> Patch:
        """Take it off again."""
        return {'speed_zero': value}
