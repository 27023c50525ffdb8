# SPDX-License-Identifier: Apache-2.0
"""Packets of Dynamixel Protocol 2.0 as bytes, from the servo's side.

Source: ROBOTIS e-Manual, https://emanual.robotis.com/docs/en/dxl/protocol2/
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

HEADER = b'\xff\xff\xfd\x00'
STUFFED = b'\xff\xff\xfd'
BROADCAST = 0xFE
STATUS = 0x55
_OVERHEAD = len(HEADER) + 3
"""Bytes before those that the length counts: header, id, length."""


@dataclass(frozen=True)
class Packet:
    """An instruction, or the status that answers one.

    Attributes:
        id: of the servo; BROADCAST for all.
        instruction: a code, STATUS for an answer.
        parameters: what follows it; of a status the error first.
    """

    id: int
    instruction: int
    parameters: bytes = b''


def crc16(data: bytes) -> int:
    """CRC-16 of polynomial 0x8005 that starts at 0, most significant bit first."""
    value = 0
    for byte in data:
        value = ((value << 8) & 0xFFFF) ^ _TABLE[(value >> 8) ^ byte]
    return value


def encoded(packet: Packet) -> bytes:
    """A packet's bytes, stuffed, with its CRC."""
    body = stuffed(bytes([packet.instruction]) + packet.parameters)
    return sealed(packet.id, body)


def sealed(servo: int, body: bytes) -> bytes:
    """A body that is stuffed already between header and CRC."""
    data = HEADER + bytes([servo]) + (len(body) + 2).to_bytes(2, 'little') + body
    return data + crc16(data).to_bytes(2, 'little')


def status(servo: int, error: int, data: bytes = b'') -> Packet:
    """The answer of a servo."""
    return Packet(servo, STATUS, bytes([error]) + data)


def stuffed(body: bytes) -> bytes:
    """A body in which no header occurs: FF FF FD is followed by another FD."""
    return body.replace(STUFFED, STUFFED + b'\xfd')


def unstuffed(body: bytes) -> bytes:
    """The body before it was stuffed."""
    return body.replace(STUFFED + b'\xfd', STUFFED)


@dataclass(frozen=True)
class Framing:
    """How packets lie in a stream of bytes.

    Attributes:
        header: what each begins with.
        id_at: where its servo's id is.
        size: length of the packet that some bytes begin with; None where too few tell.
        opened: the packet of so many bytes; None where its checksum is wrong.
    """

    header: bytes
    id_at: int
    size: Callable[[bytes], int | None]
    opened: Callable[[bytes], Packet | None]


class Reader:
    """Finds whole packets in a stream of bytes; what fits none is skipped.

    Attributes:
        damaged: how many had a wrong checksum.
    """

    def __init__(self, framing: Framing) -> None:
        self._framing = framing
        self._bytes = b''
        self.damaged = 0

    def feed(self, data: bytes) -> list[Packet]:
        """The packets that are complete with these bytes."""
        self._bytes += data
        found = []
        while (whole := self._next()) is not None:
            packet = self._framing.opened(whole)
            if packet is None:
                self.damaged += 1
                self._bytes = self._bytes[1:]
            else:
                found.append(packet)
                self._bytes = self._bytes[len(whole) :]
        return found

    def clear(self) -> None:
        """Forget what came of a packet, as a silence on the bus makes a servo do."""
        self._bytes = b''

    def _next(self) -> bytes | None:
        """The bytes that the next packet would have; None while they are not all there."""
        header = self._framing.header
        start = self._bytes.find(header)
        self._bytes = self._bytes[start if start >= 0 else 1 - len(header) :]
        size = self._framing.size(self._bytes) if start >= 0 else None
        return None if size is None or len(self._bytes) < size else self._bytes[:size]


def _size(data: bytes) -> int | None:
    return _OVERHEAD + _word(data[5:7]) if len(data) >= _OVERHEAD else None


def _opened(whole: bytes) -> Packet | None:
    if len(whole) < _OVERHEAD + 3 or crc16(whole[:-2]) != _word(whole[-2:]):
        return None
    body = unstuffed(whole[_OVERHEAD:-2])
    return Packet(whole[4], body[0], body[1:])


def _word(data: bytes) -> int:
    return int.from_bytes(data, 'little')


FRAMING = Framing(HEADER, 4, _size, _opened)


def _crc_of(byte: int) -> int:
    value = byte << 8
    for _ in range(8):
        value = (value << 1) ^ (0x8005 if value & 0x8000 else 0)
    return value & 0xFFFF


_TABLE = [_crc_of(byte) for byte in range(256)]
