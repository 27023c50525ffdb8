# SPDX-License-Identifier: Apache-2.0
"""The wire between computer and servos: packets in a stream, their time, and what goes wrong."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from leo_sim.drivers.servo_port import BITS

BROADCAST = 0xFE


@dataclass
class Trouble:
    """How often a packet fares badly, either way; each from 0 to 1."""

    lose: float = 0.0  # it does not arrive
    late: float = 0.0  # it arrives `late_by` later
    late_by: float = 0.01  # s
    cut: float = 0.0  # its end does not arrive
    wrong_crc: float = 0.0  # one of its bits is flipped
    rubbish: float = 0.0  # random bytes come before it


class Line:
    """A half-duplex serial line of `baud` bits a second; `seed` is of its troubles."""

    def __init__(self, baud: float, trouble: Trouble, seed: int = 0) -> None:
        self.baud = baud
        self.trouble = trouble
        self._rng = np.random.default_rng(seed)

    def seconds(self, count: int) -> float:
        return count * BITS / self.baud

    def carried(self, data: bytes) -> tuple[bytes, float]:
        """What arrives of a packet, and how much later than it should [s]."""
        trouble = self.trouble
        if self._happens(trouble.lose):
            return b'', 0.0
        if self._happens(trouble.cut):
            data = data[: int(self._rng.integers(1, len(data)))]
        if self._happens(trouble.wrong_crc):
            bit = int(self._rng.integers(0, 8 * len(data)))
            flipped = bytearray(data)
            flipped[bit // 8] ^= 1 << bit % 8
            data = bytes(flipped)
        if self._happens(trouble.rubbish):
            data = self._rng.bytes(int(self._rng.integers(1, 9))) + data
        return data, trouble.late_by if self._happens(trouble.late) else 0.0

    def _happens(self, share: float) -> bool:
        return share > 0.0 and self._rng.random() < share


@dataclass(frozen=True)
class Packet:
    """An instruction, or the status that answers one, whose first parameter is the error."""

    id: int
    instruction: int
    parameters: bytes = b''


@dataclass(frozen=True)
class Framing:
    header: bytes  # what each begins with
    id_at: int  # where its servo's id is
    size: Callable[[bytes], int | None]
    """Length of the packet that some bytes begin with; None where they are too few."""
    opened: Callable[[bytes], Packet | None]
    """The packet of so many bytes; None where its checksum is wrong."""


class Reader:
    """Finds whole packets in a stream of bytes; what fits none is skipped."""

    def __init__(self, framing: Framing) -> None:
        self._framing = framing
        self._bytes = b''

    def feed(self, data: bytes) -> list[Packet]:
        self._bytes += data
        found = []
        while (whole := self._next()) is not None:
            packet = self._framing.opened(whole)
            if packet is None:
                self._bytes = self._bytes[1:]
            else:
                found.append(packet)
                self._bytes = self._bytes[len(whole) :]
        return found

    def clear(self) -> None:
        self._bytes = b''

    def _next(self) -> bytes | None:
        """The bytes that the next packet would have; None while they are not all there."""
        header = self._framing.header
        start = self._bytes.find(header)
        self._bytes = self._bytes[start if start >= 0 else 1 - len(header) :]
        size = self._framing.size(self._bytes) if start >= 0 else None
        return None if size is None or len(self._bytes) < size else self._bytes[:size]
