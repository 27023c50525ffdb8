# SPDX-License-Identifier: Apache-2.0
"""The logged speed has the wrong sign."""

from __future__ import annotations

from dataclasses import replace

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault, Patch
from leo_diffmodel.faults.catalogue.speed_scale import scaled


class SpeedSign(Fault):
    """The logged speed has the wrong sign."""

    name = 'speed_sign'
    channel = 'speed'
    law = 'w = -dq/dt'
    harmless = (0.0, float('inf'))
    looks_like = 'The angle falls while the speed is positive.'
    confused_with = 'angle_sign.'
    costs = 'Friction seems to drive the joint; nothing is named, or a hand is.'

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """Turn the speed about."""
        return replace(e, dq=scaled(e.dq, j, -1.0))

    def patch(self, value: float) -> Patch:
        """Turn it back."""
        return {'speed_scale': 1 / value}
