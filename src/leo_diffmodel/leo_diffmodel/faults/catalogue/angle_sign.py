# SPDX-License-Identifier: Apache-2.0
"""The logged angle has the wrong sign, the speed has not."""

from __future__ import annotations

from dataclasses import replace

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault, Patch
from leo_diffmodel.faults.catalogue.speed_scale import scaled


class AngleSign(Fault):
    """The logged angle has the wrong sign, the speed has not."""

    name = 'angle_sign'
    channel = 'angle'
    law = 'q_log = -q'
    harmless = (0.0, float('inf'))
    looks_like = 'The angle falls while the speed is positive, and inputs turn the joint back.'
    confused_with = 'speed_sign.'
    costs = 'As for speed_sign.'

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """Turn the angle about."""
        return replace(e, q=scaled(e.q, j, -1.0))

    def patch(self, value: float) -> Patch:
        """Turn it back."""
        return {'scale': 1 / value}
