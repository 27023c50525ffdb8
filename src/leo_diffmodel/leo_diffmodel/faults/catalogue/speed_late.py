# SPDX-License-Identifier: Apache-2.0
"""The speed comes later than the angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Episode
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

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """Hold the speed back."""
        return replace(e, dq=held_back(e.t, e.dq, j, value))

    def patch(self, value: float) -> Patch:
        """Bring it forward."""
        return {'speed_late': value}


def held_back(t: Array, values: Array, j: int, seconds: float) -> Array:
    """One column as it was `seconds` ago."""
    out = values.copy()
    out[:, j] = np.interp(t - seconds, t, values[:, j])
    return out
