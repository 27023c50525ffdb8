# SPDX-License-Identifier: Apache-2.0
"""What Dynamixel servos on one bus answer: packets of Protocol 2.0, and their instructions.

Source: ROBOTIS e-Manual, https://emanual.robotis.com/docs/en/dxl/protocol2/
"""

from collections.abc import Mapping
from itertools import takewhile

from dynamixel_sdk import Protocol2PacketHandler

from leo_sim.drivers.servo_bus.line import Framing, Packet
from leo_sim.drivers.servo_bus.servo import Servo

HEADER = b'\xff\xff\xfd\x00'
STUFFED = b'\xff\xff\xfd'
STATUS = 0x55
_OVERHEAD = len(HEADER) + 3  # bytes before those that the length counts: header, id, length
PING, READ, WRITE, SYNC_READ, SYNC_WRITE = 0x01, 0x02, 0x03, 0x82, 0x83
INSTRUCTION_ERROR = 2
_SDK = Protocol2PacketHandler()
NEVER, ON_READ = 0, 1  # values of status_return_level below 2, which answers everything


def crc16(data: bytes) -> int:
    return int(_SDK.updateCRC(0, data, len(data)))


def encoded(packet: Packet) -> bytes:
    body = stuffed(bytes([packet.instruction]) + packet.parameters)
    data = HEADER + bytes([packet.id]) + (len(body) + 2).to_bytes(2, 'little') + body
    return data + crc16(data).to_bytes(2, 'little')


def status(servo: int, error: int, data: bytes = b'') -> Packet:
    return Packet(servo, STATUS, bytes([error]) + data)


def stuffed(body: bytes) -> bytes:
    """A body in which no header occurs: FF FF FD is followed by another FD."""
    return body.replace(STUFFED, STUFFED + b'\xfd')


def unstuffed(body: bytes) -> bytes:
    return body.replace(STUFFED + b'\xfd', STUFFED)


def _word(data: bytes) -> int:
    return int.from_bytes(data[:2], 'little')


def _size(data: bytes) -> int | None:
    return _OVERHEAD + _word(data[5:7]) if len(data) >= _OVERHEAD else None


def _opened(whole: bytes) -> Packet | None:
    if len(whole) < _OVERHEAD + 3 or crc16(whole[:-2]) != _word(whole[-2:]):
        return None
    body = unstuffed(whole[_OVERHEAD:-2])
    return Packet(whole[4], body[0], body[1:])


FRAMING = Framing(HEADER, 4, _size, _opened)


class Bus:
    """Servos by id that hear each other, all but the `silent` ones; what our drivers send them.

    In a sync read each waits for the answer of the one before it: behind a silent one all are
    silent.
    """

    wide = 2  # bytes of an address, and of a length

    def __init__(self, servos: Mapping[int, Servo]) -> None:
        self.servos = servos
        self.silent: frozenset[int] = frozenset()

    def answer(self, packet: Packet, now: float) -> list[bytes]:
        """The status packets that follow an instruction heard at time `now` [s], in order."""
        awake = {n: servo for n, servo in self.servos.items() if n not in self.silent}
        for servo in awake.values():
            servo.watch(now)
            servo.hear(now)
        if packet.instruction == SYNC_READ:
            return self._sync_read(awake, packet.parameters)
        if packet.instruction == SYNC_WRITE:
            return self._sync_write(awake, packet.parameters)
        said = self._one(awake[packet.id], packet) if packet.id in awake else b''
        return [said] if said else []

    def watch(self, now: float) -> None:
        for servo in self.servos.values():
            servo.watch(now)

    def _one(self, servo: Servo, packet: Packet) -> bytes:
        data, level = packet.parameters, servo.get('status_return_level')
        if packet.instruction == PING:
            facts = servo.model.number.to_bytes(2, 'little')
            version = servo.get('firmware_version').to_bytes(1, 'little')
            return self._status(packet.id, servo.error(), facts + version)
        if packet.instruction == READ and len(data) == 4:
            return b'' if level == NEVER else self._read(packet.id, servo, data)
        error = self._act(servo, packet)
        return b'' if level <= ON_READ else self._status(packet.id, error)

    def _act(self, servo: Servo, packet: Packet) -> int:
        values = packet.parameters[self.wide :]
        if packet.instruction == WRITE and values:
            return servo.write(self._number(packet.parameters), values)
        return servo.error(INSTRUCTION_ERROR)

    def _sync_read(self, awake: Mapping[int, Servo], data: bytes) -> list[bytes]:
        asked = takewhile(awake.__contains__, data[2 * self.wide :])
        return [self._read(number, awake[number], data) for number in asked]

    def _sync_write(self, awake: Mapping[int, Servo], data: bytes) -> list[bytes]:
        address, length = self._number(data), self._number(data[self.wide :])
        for start in range(2 * self.wide, len(data) - length, 1 + length):
            if data[start] in awake:
                awake[data[start]].write(address, data[start + 1 : start + 1 + length])
        return []

    def _number(self, data: bytes) -> int:
        return int.from_bytes(data[: self.wide], 'little')

    def _read(self, number: int, servo: Servo, data: bytes) -> bytes:
        at, length = self._number(data), self._number(data[self.wide :])
        return self._status(number, *servo.read(at, length))

    def _status(self, number: int, error: int, data: bytes = b'') -> bytes:
        return encoded(status(number, error, data))
