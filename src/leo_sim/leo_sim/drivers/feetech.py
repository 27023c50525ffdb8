# SPDX-License-Identifier: Apache-2.0
"""Feetech servos of the STS series as a robot: the bus of SO-100 and SO-101, by PWM or by goals.

They have no watchdog: what drives a motor goes on doing so when the cable is pulled. A process of
its own brings PWM to 0 when this one is killed; a goal is held.
"""

from scservo_sdk import PortHandler, protocol_packet_handler

from leo_msgs_py.errors import UserError
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.guardian import Guardian
from leo_sim.drivers.servo_driver import ServoDriver
from leo_sim.drivers.servo_line import Blocks, ServoLine


class _Packets(protocol_packet_handler):
    size = 0

    def rxPacket(self, port: PortHandler) -> tuple[list[int], int]:
        packet, result = super().rxPacket(port)
        self.size = len(packet) - 6
        return packet, result


class FeetechBus(ServoLine):
    family, packets, port = 'feetech', _Packets, PortHandler

    def set(self, servo: int, name: str, value: int) -> None:
        """Write a register; one that is kept without power only where it differs, unlocked."""
        if not self._registers[name].kept:
            super().set(servo, name, value)
        elif self.get(servo, name) != value:
            super().set(servo, 'lock', 0)
            super().set(servo, name, value)
            super().set(servo, 'lock', 1)


class FeetechDriver(ServoDriver):
    line = FeetechBus
    first, last = 'present_position', 'present_current'
    alert = 0xFF
    ready = (('status_return_level', 1),)

    def __init__(self, options: DriverOptions) -> None:
        if options.robot.input == 'torque':
            raise UserError(
                f'{options.robot.name} is driven by torques, which Feetech servos do '
                'not take; give input: voltage or position, or other servos'
            )
        super().__init__(options)
        self._guardian: Guardian | None = None

    def connect(self) -> None:
        """As any servos; from then on somebody watches this process, unless they hold a goal."""
        super().connect()
        if self.info.goals is None:
            self._guardian = Guardian(self._bus.descriptor, self._rest)

    def stop(self) -> None:
        try:
            super().stop()
        finally:
            if self._guardian is not None:
                self._guardian.dismiss()
                self._guardian = None

    def _prepare(self, servo: int) -> None:
        """No PWM, which would be the time to take for a goal."""
        self._bus.set(servo, 'goal_pwm', 0)

    def _check_fresh(self, sent: float, blocks: Blocks) -> None:
        """Their answers carry no time; what came too late was cleared away."""
