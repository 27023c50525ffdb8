# SPDX-License-Identifier: Apache-2.0
"""What the encoders of a model read, and the true state behind a reading."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, cut, Index, Numbers, put
from leo_sim.effects.commands import CommandDelay
from leo_sim.effects.motor import Motor

Memory = Mapping[str, Any]
NOTHING: Memory = {}
TIME = 'time'  # in the memory: s since the run began
On = np.ndarray | None  # which motors are; None for all
DELAY = CommandDelay()


class Use(NamedTuple):
    """A placed effect, ready to run: its memory key and where it acts."""

    key: str
    effect: Any
    values: Mapping[str, Any]
    at: Index

    def recalled(self, memory: Memory) -> Any:
        """What the effect remembers; at the start of a run None, or the time."""
        return memory.get(self.key, memory.get(TIME, 0.0) if self.effect.timed else None)

    def torque(self, q: Array, dq: Array, motor: Motor, load: Array | None, memory: Memory) -> Any:
        """What a torque law says at the joints where it acts."""
        at = self.at
        return self.effect.torque(
            self.values,
            q[..., at],
            dq[..., at],
            cut(motor, at),
            None if load is None else load[..., at],
            *((self.recalled(memory),) if self.effect.remembers else ()),
        )


class Sensors:
    """The sensor laws of one model, in the order they act.

    The offset is what each encoder reads at angle 0, rad, (..., J); None where all read 0.
    """

    def __init__(self, uses: Sequence[Use], offset: Any):
        self._uses, self._offset = uses, offset
        self.dynamic = any(use.effect.dynamic for use in uses)  # readings have a past

    def sense(self, q: Array, dq: Array, memory: Memory, dt: Numbers) -> tuple[Any, Any, Memory]:
        """Measured angles and rates of the true ones dt s after the memory, and the new memory."""
        if self._offset is not None:
            q = q + self._offset
        if not self._uses:
            return q, dq, memory
        changed = dict(memory)
        for use in self._uses:
            angle, rate, kept = use.effect.sensor(
                use.values, q[..., use.at], dq[..., use.at], memory.get(use.key), dt
            )
            q, dq = put(q, use.at, angle), put(dq, use.at, rate)
            if kept is not None:
                changed[use.key] = kept
        return q, dq, changed

    def readings(self, q: Array, dq: Array, memory: Memory, dt: Array) -> tuple[Any, Any]:
        """Measured angles and rates of true ones at N + 1 instants, (N + 1, ..., J).

        The memory is that of the first; dt, (N, ..., 1), is s from each to the next.
        """
        if self._offset is not None:
            q = q + self._offset
        for use in self._uses:
            angle, rate = use.effect.readings(
                use.values, q[..., use.at], dq[..., use.at], memory.get(use.key), dt
            )
            q, dq = put(q, use.at, angle), put(dq, use.at, rate)
        return q, dq

    def recall(self, recalled: Memory, faster: Array, dt: Numbers) -> Memory:
        """What `true_state` needs of the motion so far, after it was faster (..., J) for dt s."""
        return {
            use.key: use.effect.recall(use.values, recalled.get(use.key), faster[..., use.at], dt)
            for use in self._uses
        }

    def true_state(
        self, q: Array, dq: Array, recalled: Memory = NOTHING
    ) -> tuple[Any, Any, Memory]:
        """True angles and rates (..., J) of measured ones, and what the sensors then remember.

        Recalled is what `recall` returned last; without it the sensors had settled.
        """
        memory = {}
        for use in reversed(self._uses):
            angle, rate, kept = use.effect.unsensed(
                use.values, q[..., use.at], dq[..., use.at], recalled.get(use.key)
            )
            q, dq = put(q, use.at, angle), put(dq, use.at, rate)
            if kept is not None:
                memory[use.key] = kept
        return q if self._offset is None else q - self._offset, dq, memory


def act_late(use: Use, u: Array, enabled: On, memory: Any, h: Numbers) -> tuple[Any, Any, Any]:
    """Inputs, the share of the next h s that each motor is on (None for all), and the memory.

    Where y(t) = x(t - d) is the joint state d s ago, y' = f(y(t), u(t - d)): windows that start
    from readings need no state of the joints themselves, only inputs (..., A) and `enabled`
    (booleans, shares, None for all) that act d s late, by the measurement delay `use`.
    """
    off = np.zeros_like(u) if enabled is None else 1.0 - np.asarray(enabled, dtype=float)
    both = np.concatenate(np.broadcast_arrays(u, off), axis=-1)
    both, memory = DELAY.command(use.values, both, memory, h)
    u, off = np.split(both, 2, axis=-1)
    return u, 1.0 - off if off.any() else None, memory
