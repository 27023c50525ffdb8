# SPDX-License-Identifier: Apache-2.0
"""The logged angle has the wrong sign, the speed has not."""

from __future__ import annotations

from leo_diffmodel.faults.base import Array, Fault, Patch


class AngleSign(Fault):
    """The logged angle has the wrong sign, the speed has not."""

    name = 'angle_sign'
    channel = 'angle'
    law = 'q_log = -q'
    harmless = (0.0, float('inf'))
    looks_like = 'The angle falls while the speed is positive, and inputs turn the joint back.'
    confused_with = 'speed_sign.'
    costs = 'As for speed_sign.'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return -x

    def patch(self, value: float) -> Patch:
        return {'scale': 1 / value}
