# SPDX-License-Identifier: Apache-2.0
"""A sensor stays at the end of its range."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.faults.base import Array, Fault


class Clipped(Fault):
    """A sensor stays at the end of its range while the joint goes on."""

    name = 'clipped'
    channel = 'speed'
    unit = 'rad/s'
    law = 'w = clip(dq/dt, -c, c)'
    harmless = (0.0, 0.0)
    looks_like = 'Flat tops at one and the same value.'
    confused_with = 'A motor at its no-load speed: then the angle says so, too.'
    costs = 'Quadratic drag or a weak supply is named.'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return np.clip(x, -value, value)

    def patch(self, value: float) -> dict:
        return {'speed': 'none'}
