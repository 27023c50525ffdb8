# SPDX-License-Identifier: Apache-2.0
"""The logged speed has the wrong sign."""

from __future__ import annotations

from leo_diffmodel.faults.base import Array, Fault, Patch


class SpeedSign(Fault):
    """The logged speed has the wrong sign."""

    name = 'speed_sign'
    channel = 'speed'
    law = 'w = -dq/dt'
    harmless = (0.0, float('inf'))
    looks_like = 'The angle falls while the speed is positive.'
    confused_with = 'angle_sign.'
    costs = 'Friction seems to drive the joint; nothing is named, or a hand is.'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return -x

    def patch(self, value: float) -> Patch:
        return {'speed_scale': 1 / value}
