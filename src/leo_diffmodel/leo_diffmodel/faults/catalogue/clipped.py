# SPDX-License-Identifier: Apache-2.0
"""A sensor stays at the end of its range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault


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

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """Limit the speed."""
        dq = e.dq.copy()
        dq[:, j] = np.clip(dq[:, j], -value, value)
        return replace(e, dq=dq)

    def patch(self, value: float) -> dict:
        """Do without this speed."""
        return {'speed': 'none'}
