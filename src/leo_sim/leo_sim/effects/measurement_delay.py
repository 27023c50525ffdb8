# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Reading, Values

TINY = 1e-12


class MeasurementDelay(Effect):
    """The measured joint state, all of it, is the true one `delay` seconds ago.

    The memory (3, n, ..., joints) holds ages s, angles and rates of the last n states, newest
    first; between them the state is taken as straight, before the oldest as at rest there.
    """

    name = 'measurement_delay'
    family = 'sensor'
    hook = 'sensor'
    parameters = (Parameter('delay', 's', low=0.0, high=0.5, role='delay'),)
    equation = 'q_read(t) = q(t - delay), w_read(t) = w(t - delay)'
    looks_like = 'Every answer to a change of the command comes late by the same time.'
    confused_with = (
        'command_delay of all joints: the same where only states and commands are '
        'seen; actuator_lag, armature.'
    )
    reveal = 'Steps and fast square waves, sampled at 100 Hz or more.'
    dynamic = True
    late = True
    rank = 90

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        if memory is None or np.any(dt):
            memory = self._seen(q, dq, memory, dt, np.max(p['delay']))
        ages, angles, rates = np.moveaxis(memory, 1, -1)
        span = np.maximum(np.diff(ages), TINY)
        share = np.clip((np.asarray(p['delay'])[..., None] - ages[..., :-1]) / span, 0.0, 1.0)
        return _back(angles, share), _back(rates, share), memory

    @staticmethod
    def _seen(q: Array, dq: Array, memory: Any, dt: Numbers, longest: float) -> Any:
        """The memory with the state of now, less what no delay up to `longest` reaches."""
        newest = np.stack(np.broadcast_arrays(0.0, q, dq))[:, None]
        if memory is None:
            return newest
        older = memory + np.array([1.0, 0.0, 0.0]).reshape(3, *[1] * (memory.ndim - 1)) * dt
        parts = np.broadcast_shapes(newest.shape[2:], older.shape[2:])
        memory = np.concatenate(
            [np.broadcast_to(part, (*part.shape[:2], *parts)) for part in (newest, older)], axis=1
        )
        ages = memory[0].reshape(memory.shape[1], -1).min(axis=1)
        return memory[:, : 1 + int(np.searchsorted(ages, longest))]


def _back(states: Array, share: Array) -> Array:
    """From the newest of the states (..., n) by shares (..., n - 1) of the steps to older ones."""
    steps = share * np.diff(states)
    newest = np.broadcast_to(states[..., :1], (*steps.shape[:-1], 1))
    return np.cumsum(np.concatenate([newest, steps], axis=-1), axis=-1)[..., -1]
