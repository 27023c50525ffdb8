# SPDX-License-Identifier: Apache-2.0
"""Dynamixel servos as a robot: PWM mode for volts, current mode for torques, position mode."""

from __future__ import annotations

import math

import numpy as np

from leo_msgs_py.values import Applied
from leo_sim.drivers.base import DriverFault, DriverOptions, TransientFault
from leo_sim.drivers.dynamixel_bus import DynamixelBus
from leo_sim.drivers.servo_clock import ServoClock, TICKS
from leo_sim.drivers.servo_driver import ServoDriver
from leo_sim.drivers.servo_line import Block

ALERT = 0x80
TIME_BASED = 0x04
"""Bit of drive_mode with which profile_velocity is a time."""
WATCHDOG_UNIT, WATCHDOG_MOST = 0.02, 127
LATE = 0.5
"""How many periods a servo's clock may fall behind ours from one reading to the next."""
EXPIRED = -1


class DynamixelDriver(ServoDriver):
    """Dynamixel servos on one bus; they stop by themselves where no packet comes."""

    line = DynamixelBus
    first, last = 'realtime_tick', 'present_temperature'

    def __init__(self, options: DriverOptions) -> None:
        super().__init__(options)
        file = options.robot.driver.dynamixel
        assert file is not None
        self._wait = file.watchdog.value
        self._armed = False
        self._ticks: dict[int, tuple[int, float]] = {}
        self._clock = ServoClock()

    def write(self, values: np.ndarray) -> Applied:
        """All motors; the first one arms the servos' watchdogs: now packets come each period."""
        if not self._armed:
            self._arm()
        return super().write(values)

    def _configure(self, servo: int) -> None:
        """Torque off, watchdog cleared; all the PWM there may be, and profiles in rad/s.

        Both matter to position goals alone: PWM mode begins at 0 after this.
        """
        self._bus.set(servo, 'torque_enable', 0)
        self._bus.set(servo, 'bus_watchdog', 0)
        self._bus.set(servo, 'status_return_level', 2)
        self._bus.set(servo, 'return_delay_time', 0)
        if servo in self._motors.ids:
            self._bus.set(servo, 'goal_pwm', self._bus.get(servo, 'pwm_limit'))
            drive = self._bus.get(servo, 'drive_mode')
            self._bus.set(servo, 'drive_mode', drive & ~TIME_BASED)

    def _arm(self) -> None:
        waits = math.ceil(self._wait / WATCHDOG_UNIT - 1e-9)
        for servo in self._motors.ids:
            self._bus.set(servo, 'bus_watchdog', min(max(waits, 1), WATCHDOG_MOST))
        self._armed = True

    def _check_fresh(self, sent: float, blocks: dict[int, Block]) -> None:
        """Refuse answers that were late: each servo's clock must go on as ours does.

        What still comes of them is cleared away before the next question.
        """
        late = []
        for servo, block in blocks.items():
            tick = block.get('realtime_tick')
            before, asked = self._ticks.get(servo, (tick, sent))
            passed = (tick - before) % TICKS * 1e-3
            if sent - asked - passed > LATE / self.info.state_rate:
                late.append(servo)
            self._ticks[servo] = tick, sent
        if late:
            raise TransientFault(f'{self._who(late[0])} answered late')

    def _measured(self, sent: float, answered: float, blocks: dict[int, Block]) -> float:
        ticks = {servo: block.get('realtime_tick') for servo, block in blocks.items()}
        return self._clock.moment(sent, answered, ticks)

    def _alerts(self, block: Block) -> bool:
        return bool(block.error & ALERT)

    def _check_on(self, servo: int) -> None:
        super()._check_on(servo)
        if self._bus.get(servo, 'bus_watchdog') == EXPIRED:
            raise DriverFault(
                f'{self._who(servo)} has stopped itself: no packet came for '
                f'{self._wait:g} s; start the robot again'
            )
