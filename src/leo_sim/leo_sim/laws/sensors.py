# SPDX-License-Identifier: Apache-2.0
"""What the encoders of a model read, and the true state behind a reading."""
from collections.abc import Mapping, Sequence
from typing import Any

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.laws.placement import put, Use

Memory = Mapping[str, Any]
Past = Sequence[tuple[Any, Any]]


class Sensors:
    """The sensor laws of one model.

    Attributes:
        dynamic: A reading depends on what went before.

    Args:
        uses: The sensor effects in the order they act.
        offset: What each encoder reads at angle 0, rad, (..., J); None where all read 0.
    """

    def __init__(self, uses: Sequence[Use], offset: Any):
        self._uses, self._offset = uses, offset
        self.dynamic = any(use.effect.dynamic for use in uses)

    def sense(self, q: Array, dq: Array, memory: Memory, dt: Numbers) -> tuple[Any, Any, Memory]:
        """Measured angles and rates of the true ones dt s after the memory, and the new memory."""
        if self._offset is not None:
            q = q + self._offset
        if not self._uses:
            return q, dq, memory
        changed = dict(memory)
        for use in self._uses:
            angle, rate, kept = use.effect.sensor(
                use.values, q[..., use.at], dq[..., use.at], memory.get(use.key), dt)
            q, dq = put(q, use.at, angle), put(dq, use.at, rate)
            if kept is not None:
                changed[use.key] = kept
        return q, dq, changed

    def true_state(self, q: Array, dq: Array, past: Past = ()) -> tuple[Any, Any, Memory]:
        """True angles and rates of measured ones, and what the sensors then remember.

        Args:
            q: Measured angles, (..., J).
            dq: Measured rates, (..., J).
            past: Accelerations of the joints (..., J) and how long each held, s, up to now;
                without them the sensors had settled.
        """
        memory = {}
        for use in reversed(self._uses):
            angle, rate, kept = use.effect.unsensed(
                use.values, q[..., use.at], dq[..., use.at],
                [(faster[..., use.at], dt) for faster, dt in past])
            q, dq = put(q, use.at, angle), put(dq, use.at, rate)
            if kept is not None:
                memory[use.key] = kept
        return q if self._offset is None else q - self._offset, dq, memory
