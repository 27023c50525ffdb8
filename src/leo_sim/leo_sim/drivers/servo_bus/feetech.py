# SPDX-License-Identifier: Apache-2.0
"""Servos of Feetech's STS series: their packets, and what they answer.

Source: Feetech's protocol manual (doc.feetech.cn) and its SCServo library: FF FF, id, length,
instruction or error, parameters, and the inverted sum of all but the header.
"""

from leo_sim.drivers.servo_bus import dynamixel
from leo_sim.drivers.servo_bus.line import Framing, Packet
from leo_sim.drivers.servo_bus.servo import GOALS, Servo

HEADER = b'\xff\xff'
RANGE = 0x80  # what is not there is not answered; the SDK takes no error of this size


def encoded(servo: int, code: int, data: bytes = b'') -> bytes:
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
        super().restart()
        self.set('goal_pwm', 0)
        self.set('pwm_limit', self.get('max_torque_limit'))

    @property
    def goal(self) -> int | None:
        goal, low = super().goal, self.get('min_position_limit')
        return None if goal is None else min(max(goal, low), self.get('max_position_limit'))

    def watch(self, now: float) -> None:
        """Nothing: they have no watchdog, and go on."""

    def error(self, code: int = 0) -> int:
        return self.get('hardware_error_status')

    def _objection(self, name: str, value: int) -> int:
        register = self._registers[name]
        if not register.writable or (register.kept and self.get('lock')):
            return RANGE
        if name == 'torque_enable' and self.error() & self.get('shutdown'):
            return RANGE if value else 0
        return RANGE if name in GOALS[:1] and abs(value) > self.get('pwm_limit') else 0


class FeetechBus(dynamixel.Bus):
    """Servos that hear each other; one that refuses a value keeps the old one and says nothing."""

    wide = 1

    def _one(self, servo: Servo, packet: Packet) -> bytes:
        if packet.instruction == dynamixel.READ and len(packet.parameters) == 2:
            return self._read(packet.id, servo, packet.parameters)
        if packet.instruction == dynamixel.WRITE:
            self._act(servo, packet)
        return self._status(packet.id, servo.error())

    def _status(self, number: int, error: int, data: bytes = b'') -> bytes:
        return encoded(number, error, data)
