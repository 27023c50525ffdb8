# SPDX-License-Identifier: Apache-2.0
"""The speed is not zero where the joint stands."""

from __future__ import annotations

from leo_diffmodel.faults.base import Array, Fault, Patch


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

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return x + value

    def patch(self, value: float) -> Patch:
        return {'speed_zero': value}
