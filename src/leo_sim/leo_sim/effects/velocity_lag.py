# SPDX-License-Identifier: Apache-2.0
"""The measured rate follows the true one as a first-order lag of time constant tau."""
from collections.abc import Sequence
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers, paired
from leo_sim.effects.base import Effect, Parameter, Values

TINY = 1e-200


class VelocityLag(Effect):
    """The measured rate follows the true one as a first-order lag of time constant tau.

    Exact for a true rate that is straight over dt. The memory (2, ..., joints) holds the
    measured and the true rate.
    """

    name = 'velocity_lag'
    family = 'sensor'
    hook = 'sensor'
    parameters = (Parameter('tau', 's', low=0.0, high=0.5, role='delay'),)
    equation = 'tau dw_read/dt = w - w_read'
    looks_like = 'The rate is not the derivative of the angle: it comes late and rounded.'
    confused_with = 'measurement_delay, which holds up the angle too.'
    reveal = 'Steps and fast square waves, sampled at 100 Hz or more.'
    dynamic = True
    rank = 10

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers
               ) -> tuple[Any, Any, Any]:
        """What the encoder and its filter read."""
        if memory is None:
            return q, dq, np.stack([dq, dq])
        if not np.any(dt):
            return q, memory[0], memory
        tau, (read, before) = np.maximum(p['tau'], TINY), memory
        decay = np.exp(-dt / tau)
        behind = tau * (dq - before) / np.maximum(dt, TINY)
        read = dq - behind * (1.0 - decay) + (read - before) * decay
        return q, read, paired(read, dq)

    def unsensed(self, p: Values, q: Array, dq: Array, past: Sequence[tuple[Any, Any]]
                 ) -> tuple[Any, Any, Any]:
        """The true rate is ahead of the measured one by tau x the lagged acceleration."""
        tau, slope = np.maximum(p['tau'], TINY), past[0][0] if past else 0.0
        for faster, dt in past:
            slope = faster + (slope - faster) * np.exp(-dt / tau)
        true = dq + p['tau'] * slope
        return q, true, paired(dq, true)
