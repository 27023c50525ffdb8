# SPDX-License-Identifier: Apache-2.0
"""The angle counts from another zero than the model's."""

from __future__ import annotations

import math

from leo_diffmodel.faults.base import Array, Fault, Patch


class AngleZero(Fault):
    """The angle counts from another zero than the model's: upright instead of hanging."""

    name = 'angle_zero'
    channel = 'angle'
    unit = 'rad'
    turn = 2 * math.pi
    law = 'q_log = q + z'
    harmless = (-0.5, 0.5)
    """rad: a zero so far off is calibrated badly, and explain tries `encoder_offset`."""
    looks_like = 'Gravity pulls to another angle than the model says.'
    confused_with = 'encoder_offset (the same, small), a tilted base, a payload off the axis.'
    costs = 'Gravity has the wrong sign or direction, and no effect mends that.'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return x + value

    def patch(self, value: float) -> Patch:
        return {'offset': -value}
