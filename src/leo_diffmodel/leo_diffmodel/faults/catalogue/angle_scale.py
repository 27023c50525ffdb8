# SPDX-License-Identifier: Apache-2.0
"""The logged angle is a multiple of the true one: degrees, per cent, turns, a gear ratio."""

from __future__ import annotations

from dataclasses import replace

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault, Patch
from leo_diffmodel.faults.catalogue.speed_scale import scaled


class AngleScale(Fault):
    """The logged angle is a multiple of the true one: degrees, per cent, a gear ratio."""

    name = 'angle_scale'
    channel = 'angle'
    law = 'q_log = k q'
    harmless = (0.97, 1.03)
    looks_like = 'Angles far beyond the limits of the joint, or gravity that comes too often.'
    confused_with = 'speed_scale, time_stretch; encoder_scale where the speed is scaled as well.'
    costs = 'Gravity does not fit anywhere, and everything else is bent until it does.'

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """Multiply the angle."""
        return replace(e, q=scaled(e.q, j, value))

    def patch(self, value: float) -> Patch:
        """Divide it again."""
        return {'scale': 1 / value}
