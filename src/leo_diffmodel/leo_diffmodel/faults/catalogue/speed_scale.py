# SPDX-License-Identifier: Apache-2.0
"""The logged speed is a multiple of the true one: another unit or gear ratio."""

from __future__ import annotations

from dataclasses import replace

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Array, Fault, Patch


class SpeedScale(Fault):
    """The logged speed is a multiple of the true one: another unit or gear ratio."""

    name = 'speed_scale'
    channel = 'speed'
    law = 'w = k dq/dt'
    harmless = (0.97, 1.03)
    looks_like = 'The angle changes by another multiple than the speed says, always the same.'
    confused_with = 'angle_scale, time_stretch: who is right is told by the balance of torques.'
    costs = 'Friction and inertia come out wrong by the same factor, or a hand is suspected.'

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """Multiply the speed."""
        return replace(e, dq=scaled(e.dq, j, value))

    def patch(self, value: float) -> Patch:
        """Divide it again."""
        return {'speed_scale': 1 / value}


def scaled(values: Array, j: int, factor: float) -> Array:
    """One column multiplied."""
    out = values.copy()
    out[:, j] *= factor
    return out
