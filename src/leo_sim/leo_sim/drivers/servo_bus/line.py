# SPDX-License-Identifier: Apache-2.0
"""The wire between computer and servos: how long bytes take, and what goes wrong with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BITS = 10
"""Bits a byte takes: a start bit, eight, a stop bit."""


@dataclass
class Trouble:
    """How often a packet fares badly, either way; each from 0 to 1.

    Attributes:
        lose: it does not arrive.
        late: it arrives `late_by` later.
        late_by: s.
        cut: its end does not arrive.
        wrong_crc: one of its bits is flipped.
        rubbish: random bytes come before it.
    """

    lose: float = 0.0
    late: float = 0.0
    late_by: float = 0.01
    cut: float = 0.0
    wrong_crc: float = 0.0
    rubbish: float = 0.0


class Line:
    """A half-duplex serial line.

    Args:
        baud: bits a second.
        trouble: what goes wrong on it.
        seed: of the troubles.
    """

    def __init__(self, baud: float, trouble: Trouble, seed: int = 0) -> None:
        self.baud = baud
        self.trouble = trouble
        self._rng = np.random.default_rng(seed)

    def seconds(self, count: int) -> float:
        """Time that so many bytes take."""
        return count * BITS / self.baud

    def carried(self, data: bytes) -> tuple[bytes, float]:
        """What arrives of a packet, and how much later than it should [s]."""
        trouble = self.trouble
        if self._happens(trouble.lose):
            return b'', 0.0
        if self._happens(trouble.cut):
            data = data[: int(self._rng.integers(1, len(data)))]
        if self._happens(trouble.wrong_crc):
            data = self._flipped(data)
        if self._happens(trouble.rubbish):
            data = self._rng.bytes(int(self._rng.integers(1, 9))) + data
        return data, trouble.late_by if self._happens(trouble.late) else 0.0

    def _happens(self, share: float) -> bool:
        return share > 0.0 and self._rng.random() < share

    def _flipped(self, data: bytes) -> bytes:
        bit = int(self._rng.integers(0, 8 * len(data)))
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        return bytes(flipped)
