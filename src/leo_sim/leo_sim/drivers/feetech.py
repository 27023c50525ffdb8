# SPDX-License-Identifier: Apache-2.0
"""Feetech servos of the STS series as a robot: the bus of SO-100 and SO-101, in PWM mode.

They have no watchdog: what drives a motor goes on doing so when the cable is pulled. A process of
its own brings them to 0 when this one is killed.
"""

from __future__ import annotations

from leo_msgs_py.errors import UserError
from leo_sim.description.servos import PWM_MODES
from leo_sim.drivers.base import DriverFault, DriverOptions, TransientFault
from leo_sim.drivers.feetech_bus import FeetechBus
from leo_sim.drivers.guardian import Guardian
from leo_sim.drivers.servo_driver import ServoDriver
from leo_sim.drivers.servo_line import Block

TOLERANCE = 20
"""How far the measured duty may be from the one that was told [0.1 %]."""


class FeetechDriver(ServoDriver):
    """Feetech servos on one bus."""

    line = FeetechBus
    first, last = 'present_position', 'present_current'

    def __init__(self, options: DriverOptions) -> None:
        if options.robot.input == 'torque':
            raise UserError(f'{options.robot.name} is driven by torques, which Feetech servos do '
                            'not take; give input: voltage, or other servos')
        super().__init__(options)
        self._guardian: Guardian | None = None

    def connect(self) -> None:
        """As any servos; from then on somebody watches this process."""
        super().connect()
        self._guardian = Guardian(self._bus.descriptor, self._zeros)

    def stop(self) -> None:
        """0 V, motors on: they brake."""
        try:
            super().stop()
        finally:
            if self._guardian is not None:
                self._guardian.dismiss()
                self._guardian = None

    def _configure(self, servo: int) -> None:
        """PWM mode, at 0, then torque on."""
        self._bus.set(servo, 'torque_enable', 0)
        self._bus.set(servo, 'status_return_level', 1)
        self._bus.set(servo, 'return_delay_time', 0)
        if servo not in self._motors.ids:
            return
        self._bus.set(servo, 'operating_mode', PWM_MODES['feetech'])
        self._bus.set(servo, 'goal_pwm', 0)
        self._bus.set(servo, 'torque_enable', 1)

    def _check_fresh(self, sent: float, blocks: dict[int, Block]) -> None:
        """Nothing tells: their answers carry no time. What came too late was cleared away."""

    def _alerts(self, block: Block) -> bool:
        return bool(block.error)

    def _check_taken(self, blocks: dict[int, Block]) -> None:
        """Compare the duty on each motor with what it was told."""
        if not self._enabled:
            return
        for servo, sent in zip(self._motors.ids, self._sent, strict=True):
            if abs(blocks[servo].get('present_pwm') - sent) <= TOLERANCE:
                continue
            if not self._bus.get(servo, 'torque_enable'):
                raise DriverFault(f'{self._who(servo)} is free though nobody asked: it was '
                                  'restarted, or its supply failed; start the robot again')
            raise TransientFault(f'{self._who(servo)} has not taken the last command')
