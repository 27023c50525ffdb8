# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers, paired
from leo_sim.common.compiled import compiled
from leo_sim.effects.base import Effect, Parameter, Reading, Values

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
    of_rates = True
    rank = 10

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        if memory is None:
            return q, dq, np.stack([dq, dq])
        if not np.any(dt):
            return q, memory[0], memory
        read, before = memory
        decay, behind = _behind(p, dq - before, dt)
        read = dq - behind + (read - before) * decay
        return q, read, paired(read, dq)

    def readings(self, p: Values, q: Array, dq: Array, memory: Any, dt: Array) -> tuple[Any, Any]:
        decay, behind = _behind(p, np.diff(dq, axis=0), dt)
        first = np.zeros_like(dq[0]) if memory is None else memory[0] - memory[1]
        shape = np.broadcast_shapes(np.shape(first), behind.shape[1:])
        off = np.empty((len(dq), int(np.prod(shape))))
        off[0] = np.broadcast_to(first, shape).ravel()
        flat = (
            np.broadcast_to(part, (len(behind), *shape)).reshape(len(behind), -1)
            for part in (decay, behind)
        )
        _follow(off, *flat)
        return q, dq + off.reshape(-1, *shape)

    def recall(self, p: Values, recalled: Any, faster: Array, dt: Numbers) -> Any:
        """The lagged acceleration of the joints."""
        decay = np.exp(-dt / np.maximum(p['tau'], TINY))
        return faster if recalled is None else faster + (recalled - faster) * decay

    def unsensed(self, p: Values, q: Array, dq: Array, recalled: Any = None) -> Reading:
        """The true rate is ahead of the measured one by tau x the lagged acceleration."""
        true = dq + p['tau'] * (0.0 if recalled is None else recalled)
        return q, true, paired(dq, true)


def _behind(p: Values, gained: Array, dt: Numbers) -> tuple[Any, Any]:
    """What is left after dt s of what a reading was off by, and how far it falls behind anew."""
    tau = np.maximum(p['tau'], TINY)
    decay = np.exp(-dt / tau)
    return decay, tau * gained / np.maximum(dt, TINY) * (1.0 - decay)


@compiled
def _follow(off: Array, decay: Array, behind: Array) -> None:
    """Fill in by how much N readings differ from the truth, from the first, (N + 1, M)."""
    for n in range(len(decay)):
        off[n + 1] = off[n] * decay[n] - behind[n]
