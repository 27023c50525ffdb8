# SPDX-License-Identifier: Apache-2.0
"""Dynamixel servos as a robot: volts as PWM of the measured supply, torques as currents.

Where it stops by itself it leaves 0 V on motors that are on: they brake. A servo that shuts itself
down, and /robot/torque false, leave a motor free. See docs/your_driver.md.
"""

from __future__ import annotations

from collections.abc import Mapping
import math
import time

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_sim.drivers.base import (
    DriverFault,
    DriverOptions,
    NotPossible,
    Readings,
    robot_info,
    TransientFault,
)
from leo_sim.drivers.dynamixel_bus import Block, DynamixelBus, latency_timer
from leo_sim.drivers.dynamixel_joints import JointUnits, MotorUnits
from leo_sim.drivers.pose import farthest, pose_of
from leo_sim.servos import CURRENT_MODE, HARDWARE_ERRORS, PWM_MODE, servo_model

FIRST, LAST = 'realtime_tick', 'present_temperature'
"""The block that is read each period: the servo's clock, and all it measures."""

ALERT = 0x80
WATCHDOG_UNIT, WATCHDOG_MOST = 0.02, 127
SHARE = 0.4
"""Share of a period [s] that an answer may take on top of its bytes."""
LATE = 0.5
"""How many periods a servo's clock may fall behind ours from one reading to the next."""
TICKS = 32768
"""Its clock counts so many ms and begins anew."""
NEAR = 0.15
"""A joint so close to its start pose is in it [rad or m]."""
EXPIRED = -1
LEAST_SUPPLY = 3.0
"""No servo works below this [V]."""


class DynamixelDriver:
    """Servos on one bus, one for every joint; those without an actuator are read only."""

    def __init__(self, options: DriverOptions) -> None:
        robot = options.robot
        bus = robot.driver.dynamixel
        if bus is None:
            raise UserError(f'{robot.name} has no servos: give it some in robot.yaml, driver: '
                            'dynamixel (docs/your_driver.md)')
        self.info = robot_info(robot, options.state_rate, own_clock=False)
        self.starts = 0
        self._file = bus
        self._models = {s.id: servo_model(s.model) for s in bus.servos.values()}
        self._names = {servo.id: joint for joint, servo in bus.servos.items()}
        self._path = options.port or bus.port
        self._bus = DynamixelBus(self._path, bus.baud, self._names)
        self._joints, self._motors = JointUnits(robot, bus), MotorUnits(robot, bus)
        self._actuated = list(robot.actuated)
        self._pose = pose_of(robot, options.start)
        self._angles = np.full(len(self.info.joints), np.nan)
        count = len(self.info.actuators)
        self._sent = np.zeros(count, dtype=int)
        self._enabled, self._armed = True, False
        self._angle = self._rate = np.zeros(count)
        self._supply = np.zeros(count)
        self._conditions: dict[int, str] = {}
        self._readings: Readings | None = None
        self._cycle = 0.0
        self._ticks: dict[int, tuple[int, float]] = {}
        self._zeros = self._bus.packet(self._motors.goal, dict.fromkeys(self._motors.ids, 0))

    def connect(self) -> None:
        """Open the bus, check every servo, and leave the motors on at 0."""
        self._bus.open()
        try:
            self._make_ready()
        except (UserError, DriverFault, OSError):
            self._bus.close()
            raise

    def _make_ready(self) -> None:
        timer = latency_timer(self._path)
        if timer is not None and timer > 1:
            print(f'{self._path} keeps bytes back for {timer} ms: echo 1 | sudo tee /sys/bus/'
                  f'usb-serial/devices/{self._path.rsplit("/", 1)[-1]}/latency_timer', flush=True)
        for servo in self._joints.ids:
            self._greet(servo)
            self._configure(servo)
        self._supply = 0.1 * np.array(
            [self._bus.get(servo, 'present_input_voltage') for servo in self._motors.ids])
        self._motors.own_limits = np.array(
            [self._bus.get(servo, self._motors.limit) for servo in self._motors.ids])
        self._bus.wait_at_most(max(SHARE / self.info.state_rate, 1e-3 * ((timer or 1) + 2)))

    def read(self) -> JointStates:
        """All servos with one instruction; stamped when it was sent, which is when they measure.

        Raises:
            TransientFault: an answer is missing, damaged or of an earlier reading, or the last
                command did not arrive.
            DriverFault: a servo has let go.
        """
        began = time.monotonic()
        sent, blocks = self._bus.sync_read(self._joints.ids, FIRST, LAST)
        self._check_fresh(sent, blocks)
        angles, rates = self._joints.angles(blocks), self._joints.rates(blocks)
        self._angles = angles
        self._angle, self._rate = angles[self._actuated], rates[self._actuated]
        self._note(blocks)
        self._check_alerts(blocks)
        self._check_taken(blocks)
        now = time.monotonic()
        self._cycle = now - began
        stamp_ns = time.time_ns() - round((now - sent) * 1e9)
        return JointStates(stamp_ns, self.info.joints, angles, rates)

    def write(self, values: np.ndarray) -> Applied:
        """All motors with one instruction; what its counts are at the measured supply.

        The first one arms the servos' watchdogs: from now on packets come each period.
        """
        if not self._armed:
            self._arm()
        allowed = self._motors.allowed(values, self._angle, self._rate)
        self._sent = self._motors.counts(allowed, self._supply) * self._enabled
        self._bus.sync_write(self._motors.goal, dict(
            zip(self._motors.ids, self._sent.tolist(), strict=True)))
        return self._applied()

    def halt(self) -> Applied:
        """0 to all motors, twice since nobody answers; other calls may wait for the bus."""
        self._sent = np.zeros_like(self._sent)
        self._bus.send(self._zeros)
        self._bus.send(self._zeros)
        return self._applied()

    def advance(self, seconds: float) -> float:
        """Time passes by itself."""
        return seconds

    def set_torque(self, on: bool) -> None:
        """Motors on at 0, or free."""
        self.halt()
        for servo in self._motors.ids:
            self._bus.set(servo, 'torque_enable', int(on))
        self._enabled = on

    def reset(self) -> None:
        """Begin anew where somebody has put the robot into its start pose by hand.

        Raises:
            NotPossible: it is elsewhere.
        """
        joint, off = farthest(self._pose, self.info.joints, self._angles)
        if off > NEAR:
            raise NotPossible(f'put it into its start pose by hand: {joint} is {off:.2f} off; '
                              '/robot/torque false frees it')
        self.starts += 1

    def stop(self) -> None:
        """0 V, motors on: they brake. The servos' watchdogs stay armed."""
        if not self._bus.is_open:
            return
        try:
            self.halt()
        finally:
            self._bus.close()

    def readings(self) -> Readings | None:
        """What the last state came with."""
        return self._readings

    def figures(self) -> Mapping[str, str]:
        """Port and time of a reading."""
        timer = latency_timer(self._path)
        return {
            'port': self._path,
            'bus read ms': f'{1e3 * self._cycle:.2f}',
            'usb latency timer ms': 'none' if timer is None else str(timer),
        }

    def _greet(self, servo: int) -> None:
        """Check that a servo is there, is what it should be, and is well."""
        model, found = self._models[servo], self._bus.ping(servo)
        who = f'servo {servo} ({self._names[servo]})'
        if found is None:
            raise UserError(f'{who} does not answer on {self._path} at {self._file.baud} baud; '
                            'look at its supply, its cable, its id and its baud rate')
        if found != model.number:
            raise UserError(f'{who} is of model number {found}, robot.yaml says {model.name} '
                            f'({model.number})')
        if error := self._bus.get(servo, 'hardware_error_status'):
            raise UserError(f'{who} has stopped itself: {_said(error)}; mend that, then switch '
                            'its supply off and on')

    def _configure(self, servo: int) -> None:
        """Make a servo ready: watchdog cleared, mode set, at 0, then torque on.

        The motor is free meanwhile: its mode cannot be changed otherwise.
        """
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
        waits = math.ceil(self._file.watchdog.value / WATCHDOG_UNIT - 1e-9)
        for servo in self._motors.ids:
            self._bus.set(servo, 'bus_watchdog', min(max(waits, 1), WATCHDOG_MOST))
        self._armed = True

    def _note(self, blocks: dict[int, Block]) -> None:
        """Keep what was measured besides angles."""
        own = [blocks[servo] for servo in self._motors.ids]
        self._supply = 0.1 * np.array([block.get('present_input_voltage') for block in own])
        if self._supply.min() < LEAST_SUPPLY:
            raise TransientFault(f'a servo measures a supply of {self._supply.min():.1f} V')
        self._readings = Readings(
            supply=float(np.median(self._supply)),
            current=self._motors.currents(blocks),
            temperature=np.array([block.get('present_temperature') for block in own]),
            condition=tuple(self._conditions.get(servo, '') for servo in self._motors.ids),
        )

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
            raise TransientFault(f'servo {late[0]} ({self._names[late[0]]}) answered late')

    def _check_alerts(self, blocks: dict[int, Block]) -> None:
        """Look at servos that say something is wrong; those that let go end the run."""
        for servo, block in blocks.items():
            if not block.error & ALERT:
                self._conditions.pop(servo, None)
            elif servo not in self._conditions:
                error = self._bus.get(servo, 'hardware_error_status')
                self._conditions[servo] = _said(error)
                if error & self._bus.get(servo, 'shutdown'):
                    raise DriverFault(
                        f'servo {servo} ({self._names[servo]}) has let go: {_said(error)}; it is '
                        'free, the others brake at 0 V; mend that, then switch its supply off and '
                        'on'
                    )

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
        who = f'servo {servo} ({self._names[servo]})'
        if not self._bus.get(servo, 'torque_enable'):
            raise DriverFault(f'{who} is free though nobody asked: it was restarted, or its '
                              'supply failed; start the robot again')
        if self._bus.get(servo, 'bus_watchdog') == EXPIRED:
            raise DriverFault(f'{who} has stopped itself: no packet came for '
                              f'{self._file.watchdog.value:g} s; start the robot again')
        raise TransientFault(f'{who} has not taken the last command')

    def _applied(self) -> Applied:
        return Applied(
            stamp_ns=time.time_ns(),
            names=self.info.actuators,
            values=self._motors.values(self._sent, self._supply),
            interface=self.info.interface,
            enabled=np.full(len(self._sent), self._enabled),
        )


def _said(error: int) -> str:
    """A hardware error in words."""
    known = [text for bit, text in HARDWARE_ERRORS.items() if error & bit]
    return ', '.join(known) or f'hardware error {error}'
