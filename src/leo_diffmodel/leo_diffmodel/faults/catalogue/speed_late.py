# SPDX-License-Identifier: Apache-2.0
"""The speed comes later than the angle."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.faults.base import Array, Fault, Patch


class SpeedLate(Fault):
    """The speed comes later than the angle, by a delay; one period where rows are one apart."""

    name = 'speed_late'
    channel = 'speed'
    unit = 's'
    law = 'w(t) = dq/dt(t - d)'
    harmless = (-0.02, 0.06)
    """s: a driver filters, and explain tries `velocity_lag` and `measurement_delay`."""
    looks_like = 'The speed has its peaks after the angle is steepest.'
    confused_with = 'speed_filter, which rounds the peaks as well.'
    costs = 'Damping comes out wrong, or a delay of the commands is named.'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return np.interp(t - value, t, x)

    def patch(self, value: float) -> Patch:
        return {'speed_late': value}
