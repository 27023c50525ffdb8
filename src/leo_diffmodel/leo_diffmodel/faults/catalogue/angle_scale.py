# SPDX-License-Identifier: Apache-2.0
"""The logged angle is a multiple of the true one: degrees, per cent, turns, a gear ratio."""

from __future__ import annotations

from leo_diffmodel.faults.base import Array, Fault, Patch


class AngleScale(Fault):
    """The logged angle is a multiple of the true one: degrees, per cent, a gear ratio."""

    name = 'angle_scale'
    channel = 'angle'
    law = 'q_log = k q'
    harmless = (0.97, 1.03)
    looks_like = 'Angles far beyond the limits of the joint, or gravity that comes too often.'
    confused_with = 'speed_scale, time_stretch; encoder_scale where the speed is scaled as well.'
    costs = 'Gravity does not fit anywhere, and everything else is bent until it does.'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return value * x

    def patch(self, value: float) -> Patch:
        return {'scale': 1 / value}
