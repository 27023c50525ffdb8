# SPDX-License-Identifier: Apache-2.0
"""Dry friction in one part of the turn: something rubs there."""

from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter, Values


class SectorFriction(Effect):
    """Dry friction whose level is c exp(-((q - centre) / width)^2), within a turn."""

    name = 'sector_friction'
    family = 'outside'
    hook = 'torque'
    parameters = (
        Parameter('c', 'N m', low=0.0),
        Parameter('centre', 'rad'),
        Parameter('width', 'rad', neutral=1.0, low=0.01),
    )
    dry = True

    def torque(self, p: Values, q: Any, dq: Any, motor: Any, load: Any) -> Any:
        """The level, as a torque along motion."""
        away = np.remainder(q - p['centre'] + np.pi, 2 * np.pi) - np.pi
        return p['c'] * np.exp(-((away / p['width']) ** 2)) + 0.0 * dq
