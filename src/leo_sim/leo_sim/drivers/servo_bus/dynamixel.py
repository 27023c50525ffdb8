# SPDX-License-Identifier: Apache-2.0
"""What Dynamixel servos on one bus answer: packets of Protocol 2.0, and their instructions.

Source: ROBOTIS e-Manual, https://emanual.robotis.com/docs/en/dxl/protocol2/
"""

from collections.abc import Iterator, Mapping

from dynamixel_sdk import Protocol2PacketHandler

from leo_sim.drivers.servo_bus.line import BROADCAST, Framing, Packet
from leo_sim.drivers.servo_bus.servo import Servo

HEADER = b'\xff\xff\xfd\x00'
STUFFED = b'\xff\xff\xfd'
STATUS = 0x55
_OVERHEAD = len(HEADER) + 3  # bytes before those that the length counts: header, id, length
PING, READ, WRITE, REG_WRITE, ACTION, REBOOT = 0x01, 0x02, 0x03, 0x04, 0x05, 0x08
SYNC_READ, SYNC_WRITE, FAST_SYNC_READ, BULK_READ, BULK_WRITE = 0x82, 0x83, 0x8A, 0x92, 0x93
INSTRUCTION_ERROR = 2
_SDK = Protocol2PacketHandler()
NEVER, ON_READ = 0, 1  # values of status_return_level below 2, which answers everything


def crc16(data: bytes) -> int:
    return int(_SDK.updateCRC(0, data, len(data)))


def encoded(packet: Packet) -> bytes:
    return sealed(packet.id, stuffed(bytes([packet.instruction]) + packet.parameters))


def sealed(servo: int, body: bytes) -> bytes:
    data = HEADER + bytes([servo]) + (len(body) + 2).to_bytes(2, 'little') + body
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
    """Servos by id that hear each other, all but the `silent` ones.

    In a sync read each waits for the answer of the one before it: behind a silent one all are
    silent.
    """

    wide = 2  # bytes of an address, and of a length

    def __init__(self, servos: Mapping[int, Servo]) -> None:
        self.servos = servos
        self.silent: frozenset[int] = frozenset()
        self._registered: dict[int, tuple[int, bytes]] = {}

    def answer(self, packet: Packet, now: float) -> list[bytes]:
        """The status packets that follow an instruction heard at time `now` [s], in order."""
        chosen = self._awake()
        for servo in chosen.values():
            servo.watch(now)
            servo.hear(now)
        several = {
            SYNC_READ: self._sync_read,
            FAST_SYNC_READ: self._fast_sync_read,
            SYNC_WRITE: self._sync_write,
            BULK_READ: self._bulk_read,
            BULK_WRITE: self._bulk_write,
        }
        if packet.instruction in several:
            return several[packet.instruction](packet.parameters)
        if packet.id != BROADCAST:
            chosen = {number: s for number, s in chosen.items() if number == packet.id}
        said = [self._one(servo, number, packet) for number, servo in sorted(chosen.items())]
        unanswered = packet.id == BROADCAST and packet.instruction != PING
        return [] if unanswered else [data for data in said if data]

    def watch(self, now: float) -> None:
        for servo in self.servos.values():
            servo.watch(now)

    def _one(self, servo: Servo, number: int, packet: Packet) -> bytes:
        data, level = packet.parameters, servo.get('status_return_level')
        if packet.instruction == PING:
            facts = servo.model.number.to_bytes(2, 'little')
            version = servo.get('firmware_version').to_bytes(1, 'little')
            return self._status(number, servo.error(), facts + version)
        if packet.instruction == READ and len(data) == 4:
            return b'' if level == NEVER else self._read(number, servo, data)
        error = self._act(servo, number, packet)
        return b'' if level <= ON_READ else self._status(number, error)

    def _act(self, servo: Servo, number: int, packet: Packet) -> int:
        data = packet.parameters
        at, values = self._number(data), data[self.wide :]
        if packet.instruction == WRITE and values:
            return servo.write(at, values)
        if packet.instruction == REG_WRITE and values:
            self._registered[number] = at, values
            return servo.error()
        if packet.instruction == ACTION:
            return servo.write(*self._registered.pop(number, (0, b'')))
        if packet.instruction == REBOOT:
            servo.restart()
            return servo.error()
        return servo.error(INSTRUCTION_ERROR)

    def _sync_read(self, data: bytes) -> list[bytes]:
        asked = self._in_turn(data[2 * self.wide :])
        return [self._read(number, servo, data) for number, servo in asked]

    def _fast_sync_read(self, data: bytes) -> list[bytes]:
        """One status of all: error, id, data and CRC of each; it is not stuffed."""
        body = bytes([STATUS])
        found = list(self._in_turn(data[4:]))
        if len(found) < len(data) - 4:
            return []  # it never becomes whole
        length = 1 + len(found) * (4 + _word(data[2:]))
        for number, servo in found:
            error, values = servo.read(_word(data), _word(data[2:]))
            body += bytes([error, number]) + values
            so_far = HEADER + bytes([BROADCAST]) + length.to_bytes(2, 'little') + body
            body += crc16(so_far).to_bytes(2, 'little')
        return [sealed(BROADCAST, body[:-2])]

    def _bulk_read(self, data: bytes) -> list[bytes]:
        wanted = [data[i : i + 5] for i in range(0, len(data) - 4, 5)]
        found = self._in_turn(bytes(each[0] for each in wanted))
        return [self._read(*one, each[1:]) for one, each in zip(found, wanted, strict=False)]

    def _sync_write(self, data: bytes) -> list[bytes]:
        address, length = self._number(data), self._number(data[self.wide :])
        for start in range(2 * self.wide, len(data) - length, 1 + length):
            self._write(data[start], address, data[start + 1 : start + 1 + length])
        return []

    def _bulk_write(self, data: bytes) -> list[bytes]:
        while len(data) > 5:
            length = _word(data[3:])
            self._write(data[0], _word(data[1:]), data[5 : 5 + length])
            data = data[5 + length :]
        return []

    def _write(self, number: int, address: int, data: bytes) -> None:
        servo = self._awake().get(number)
        if servo is not None:
            servo.write(address, data)

    def _in_turn(self, ids: bytes) -> Iterator[tuple[int, Servo]]:
        for number in ids:
            servo = self._awake().get(number)
            if servo is None:
                return
            yield number, servo

    def _awake(self) -> dict[int, Servo]:
        return {n: servo for n, servo in self.servos.items() if n not in self.silent}

    def _number(self, data: bytes) -> int:
        return int.from_bytes(data[: self.wide], 'little')

    def _read(self, number: int, servo: Servo, data: bytes) -> bytes:
        at, length = self._number(data), self._number(data[self.wide :])
        return self._status(number, *servo.read(at, length))

    def _status(self, number: int, error: int, data: bytes = b'') -> bytes:
        return encoded(status(number, error, data))
