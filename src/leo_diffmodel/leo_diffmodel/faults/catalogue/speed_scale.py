# SPDX-License-Identifier: Apache-2.0
"""The logged speed is a multiple of the true one: another unit or gear ratio."""

from __future__ import annotations

from leo_diffmodel.faults.base import Array, Fault, Patch


class SpeedScale(Fault):
    """The logged speed is a multiple of the true one: another unit or gear ratio."""

    name = 'speed_scale'
    channel = 'speed'
    law = 'w = k dq/dt'
    harmless = (0.97, 1.03)
    looks_like = 'The angle changes by another multiple than the speed says, always the same.'
    confused_with = 'angle_scale, time_stretch: the balance of torques decides who is right.'
    costs = 'Friction and inertia come out wrong by the same factor, or a hand is suspected.'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return value * x

    def patch(self, value: float) -> Patch:
        return {'speed_scale': 1 / value}
