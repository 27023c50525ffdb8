# SPDX-License-Identifier: Apache-2.0
"""Dynamixel servos as a robot: PWM mode for voltages, current mode for torques."""

from __future__ import annotations

import math

import numpy as np

from leo_msgs_py.values import Applied
from leo_sim.description.servos import CURRENT_MODE, PWM_MODE
from leo_sim.drivers.base import DriverFault, DriverOptions, TransientFault
from leo_sim.drivers.dynamixel_bus import DynamixelBus
from leo_sim.drivers.servo_driver import ServoDriver
from leo_sim.drivers.servo_line import Block

ALERT = 0x80
WATCHDOG_UNIT, WATCHDOG_MOST = 0.02, 127
LATE = 0.5
"""How many periods a servo's clock may fall behind ours from one reading to the next."""
TICKS = 32768
"""Its clock counts so many ms and begins anew."""
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

    def write(self, values: np.ndarray) -> Applied:
        """All motors; the first one arms the servos' watchdogs: now packets come each period."""
        if not self._armed:
            self._arm()
        return super().write(values)

    def _configure(self, servo: int) -> None:
        """Watchdog cleared, mode set, at 0, then torque on."""
        self._bus.set(servo, 'torque_enable', 0)
        self._bus.set(servo, 'bus_watchdog', 0)
        self._bus.set(servo, 'status_return_level', 2)
        self._bus.set(servo, 'return_delay_time', 0)
        if servo not in self._motors.ids:
            return
        mode = PWM_MODE if self._motors.by_voltage else CURRENT_MODE
        self._bus.set(servo, 'operating_mode', mode)
        self._bus.set(servo, self._motors.goal, 0)
        self._bus.set(servo, 'torque_enable', 1)

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

    def _alerts(self, block: Block) -> bool:
        return bool(block.error & ALERT)

    def _check_taken(self, blocks: dict[int, Block]) -> None:
        """Compare the PWM on each motor with what it was told, since sync writes are unanswered.

        In current mode nothing tells.
        """
        if not (self._motors.by_voltage and self._enabled):
            return
        for servo, sent in zip(self._motors.ids, self._sent, strict=True):
            if blocks[servo].get('present_pwm') != sent:
                self._explain(servo)

    def _explain(self, servo: int) -> None:
        """Say why a servo is not at its goal."""
        who = self._who(servo)
        if not self._bus.get(servo, 'torque_enable'):
            raise DriverFault(f'{who} is free though nobody asked: it was restarted, or its '
                              'supply failed; start the robot again')
        if self._bus.get(servo, 'bus_watchdog') == EXPIRED:
            raise DriverFault(f'{who} has stopped itself: no packet came for '
                              f'{self._wait:g} s; start the robot again')
        raise TransientFault(f'{who} has not taken the last command')
