# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.base import Effect, Parameter, Values


class CommandDelay(Effect):
    """Commands act `delay` seconds late.

    Continuous in the delay: the motor gets the mean of the held values over each substep. The
    memory (2, n, ..., actuators) holds the ages s of the last n changes of the command at the
    start of the substep, oldest first, and the commands from then on.
    """

    name = 'command_delay'
    family = 'command'
    hook = 'command'
    parameters = (Parameter('delay', 's', low=0.0, high=0.5, role='delay'),)
    equation = 'u_motor(t) = u(t - delay)'
    looks_like = 'Every answer to a change of the command comes late by the same time.'
    confused_with = (
        'measurement_delay (the same where only states and commands are seen); '
        'actuator_lag, armature.'
    )
    reveal = 'Steps and fast square waves, sampled at 100 Hz or more.'
    dynamic = True
    rank = 10

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        delay = p['delay']
        memory = self._remember(u, memory)
        ages, held = memory
        late = u
        for older in range(len(held) - 1, 0, -1):
            share = 1.0 - np.clip((ages[older] + dt - delay) / np.maximum(dt, 1e-12), 0.0, 1.0)
            late = late - share * (held[older] - held[older - 1])
        return late, self._forget(np.stack([ages + dt, held]), np.max(delay))

    @staticmethod
    def _remember(u: Array, memory: Any) -> Any:
        """The memory with the command u as its newest entry, if it is new."""
        if memory is None:
            memory = np.zeros((2, 1, *np.shape(u)))
        u = np.broadcast_to(u, np.broadcast_shapes(np.shape(u), memory.shape[2:]))
        scanned = (1,) * (u.ndim + 2 - memory.ndim)
        memory = memory.reshape(*memory.shape[:2], *scanned, *memory.shape[2:])
        memory = np.broadcast_to(memory, (*memory.shape[:2], *u.shape))
        if np.array_equal(memory[1, -1], u):
            return memory
        newest = np.stack([np.zeros_like(u), u])[:, None]
        return np.concatenate([memory, newest], axis=1)

    @staticmethod
    def _forget(memory: Any, longest: float) -> Any:
        """The memory without the entries that no delay up to `longest` reaches any more."""
        ages = memory[0].reshape(memory.shape[1], -1).min(axis=1, initial=np.inf)
        spent = int(np.sum(ages[1:] >= longest))
        return memory[:, spent:]
