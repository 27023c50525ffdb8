# SPDX-License-Identifier: Apache-2.0
"""Servos of Feetech's STS series: their packets, and what they answer.

Source: Feetech's protocol manual (doc.feetech.cn) and its SCServo library: FF FF, id, length,
instruction or error, parameters, and the inverted sum of all but the header.
"""

from leo_sim.drivers.servo_bus.dynamixel import (
    ACTION,
    Bus,
    READ,
    REG_WRITE,
    SYNC_READ,
    SYNC_WRITE,
    WRITE,
)
from leo_sim.drivers.servo_bus.line import BROADCAST, Framing, Packet
from leo_sim.drivers.servo_bus.servo import GOALS, Servo

HEADER = b'\xff\xff'
RANGE = 0x80  # what is not there is not answered; the SDK takes no error of this size


def encoded(servo: int, code: int, data: bytes = b'') -> bytes:
    """A packet's bytes; `code` is an instruction, or the error of a status."""
    body = bytes([servo, len(data) + 2, code]) + data
    return HEADER + body + bytes([~sum(body) & 0xFF])


def _opened(whole: bytes) -> Packet | None:
    if whole[3] < 2 or encoded(whole[2], whole[4], whole[5:-1]) != whole:
        return None
    return Packet(whole[2], whole[4], whole[5:-1])


FRAMING = Framing(HEADER, 2, lambda data: data[3] + 4 if len(data) >= 4 else None, _opened)


class FeetechServo(Servo):
    """A servo's registers; what is kept without power is written only while `lock` is 0."""

    def restart(self) -> None:
        """What a loss of power does: RAM as at the start, torque off."""
        super().restart()
        self.set('goal_pwm', 0)
        self.set('pwm_limit', self.get('max_torque_limit'))

    @property
    def goal(self) -> int | None:
        """The position it goes to, within its limits."""
        goal, low = super().goal, self.get('min_position_limit')
        return None if goal is None else min(max(goal, low), self.get('max_position_limit'))

    def watch(self, now: float) -> None:
        """Nothing: they have no watchdog, and go on."""

    def error(self, code: int = 0) -> int:
        """What is wrong with it, in every status."""
        return self.get('hardware_error_status')

    def _objection(self, name: str, value: int) -> int:
        register = self._registers[name]
        if not register.writable or (register.kept and self.get('lock')):
            return RANGE
        if name == 'torque_enable' and self.error() & self.get('shutdown'):
            return RANGE if value else 0
        return RANGE if name in GOALS[:1] and abs(value) > self.get('pwm_limit') else 0


class FeetechBus(Bus):
    """Servos that hear each other; one that refuses a value keeps the old one and says nothing."""

    def answer(self, packet: Packet, now: float) -> list[bytes]:
        """The status packets that follow an instruction, in order."""
        data = packet.parameters
        if packet.instruction == SYNC_READ:
            return [
                encoded(n, servo.error(), servo.read(data[0], data[1])[1])
                for n, servo in self._in_turn(data[2:])
            ]
        if packet.instruction == SYNC_WRITE:
            for start in range(2, len(data) - data[1], 1 + data[1]):
                self._write(data[start], data[0], data[start + 1 : start + 1 + data[1]])
            return []
        servo = self._awake().get(packet.id)
        if packet.id == BROADCAST or servo is None:
            return []
        return [encoded(packet.id, servo.error(), self._acted(packet.id, servo, packet))]

    def _acted(self, number: int, servo: Servo, packet: Packet) -> bytes:
        """Carry out an instruction to one servo; what it answers."""
        data = packet.parameters
        if packet.instruction == READ and len(data) == 2:
            return servo.read(data[0], data[1])[1]
        if packet.instruction == WRITE and len(data) > 1:
            servo.write(data[0], data[1:])
        elif packet.instruction == REG_WRITE and len(data) > 1:
            self._registered[number] = data[0], data[1:]
        elif packet.instruction == ACTION:
            servo.write(*self._registered.pop(number, (0, b'')))
        return b''
