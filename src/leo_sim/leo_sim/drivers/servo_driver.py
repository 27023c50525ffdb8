# SPDX-License-Identifier: Apache-2.0
"""Servos on a bus as a robot: volts as PWM of the measured supply, whoever made them.

Where it stops by itself it leaves 0 V on motors that are on: they brake. A servo that shuts itself
down, and /robot/torque false, leave a motor free. See docs/your_driver.md.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
import time
from typing import ClassVar

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_sim.description.servos import HARDWARE_ERRORS, servo_model
from leo_sim.drivers.base import (
    DriverFault,
    DriverOptions,
    NotPossible,
    Readings,
    robot_info,
    TransientFault,
)
from leo_sim.drivers.pose import farthest, pose_of
from leo_sim.drivers.servo_joints import JointUnits, MotorUnits
from leo_sim.drivers.servo_line import Block, latency_timer, ServoLine

SHARE = 0.4
"""Share of a period [s] that an answer may take on top of its bytes."""
NEAR = 0.15
"""A joint so close to its start pose is in it [rad or m]."""
LEAST_SUPPLY = 3.0
"""No servo works below this [V]."""


class ServoDriver(ABC):
    """Servos on one bus, one for every joint; those without an actuator are read only.

    What a protocol has of its own is in the subclasses: how a servo is made ready, and how it is
    known that an answer is fresh, that a servo is well, and that it took the last command.
    """

    line: ClassVar[type[ServoLine]]
    first: ClassVar[str]
    last: ClassVar[str]
    """The block of registers that is read each period."""

    def __init__(self, options: DriverOptions) -> None:
        robot = options.robot
        family, bus = self.line.family, robot.driver.bus
        if bus is None or robot.driver.family != family:
            raise UserError(f'{robot.name} has no servos: give it some in robot.yaml, driver: '
                            f'{family} (docs/your_driver.md)')
        if robot.input == 'position':
            raise UserError(f'{robot.name} takes positions, and no driver here sends servos any; '
                            'drive it by voltage (input: voltage), or with a driver of your own')
        self.info = robot_info(robot, options.state_rate, own_clock=False)
        self.starts = 0
        self._file = bus
        self._models = {s.id: servo_model(s.model, family) for s in bus.servos.values()}
        self._names = {servo.id: joint for joint, servo in bus.servos.items()}
        self._path = options.port or bus.port
        self._bus = self.line(self._path, bus.baud, self._names)
        self._joints, self._motors = JointUnits(robot, bus), MotorUnits(robot, bus)
        self._actuated = list(robot.actuated)
        self._pose = pose_of(robot, options.start)
        self._angles = np.full(len(self.info.joints), np.nan)
        count = len(self.info.actuators)
        self._sent = np.zeros(count, dtype=int)
        self._enabled = True
        self._angle = self._rate = np.zeros(count)
        self._supply = np.zeros(count)
        self._conditions: dict[int, str] = {}
        self._readings: Readings | None = None
        self._cycle = 0.0
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
        sent, blocks = self._bus.sync_read(self._joints.ids, self.first, self.last)
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
        """All motors with one instruction; what its counts are at the measured supply."""
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
        """0 V, motors on: they brake."""
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
        who = self._who(servo)
        if found is None:
            raise UserError(f'{who} does not answer on {self._path} at {self._file.baud} baud; '
                            'look at its supply, its cable, its id and its baud rate')
        if found != model.number:
            raise UserError(f'{who} is of model number {found}, robot.yaml says {model.name} '
                            f'({model.number})')
        if error := self._bus.get(servo, 'hardware_error_status'):
            raise UserError(f'{who} has stopped itself: {self._said(error)}; mend that, then '
                            'switch its supply off and on')

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

    @abstractmethod
    def _configure(self, servo: int) -> None:
        """Make a servo ready, at 0, then torque on; its motor is free meanwhile."""

    @abstractmethod
    def _check_fresh(self, sent: float, blocks: dict[int, Block]) -> None:
        """Raise TransientFault where an answer is of an earlier reading."""

    @abstractmethod
    def _alerts(self, block: Block) -> bool:
        """Whether a servo says that something is wrong with it."""

    @abstractmethod
    def _check_taken(self, blocks: dict[int, Block]) -> None:
        """Raise TransientFault where a motor is not driven as it was told, DriverFault if free."""

    def _check_alerts(self, blocks: dict[int, Block]) -> None:
        """Look at servos that say something is wrong; those that let go end the run."""
        for servo, block in blocks.items():
            if not self._alerts(block):
                self._conditions.pop(servo, None)
            elif servo not in self._conditions:
                error = self._bus.get(servo, 'hardware_error_status')
                self._conditions[servo] = self._said(error)
                if error & self._bus.get(servo, 'shutdown'):
                    raise DriverFault(
                        f'{self._who(servo)} has let go: {self._said(error)}; it is free, the '
                        'others brake at 0 V; mend that, then switch its supply off and on'
                    )

    def _applied(self) -> Applied:
        return Applied(
            stamp_ns=time.time_ns(),
            names=self.info.actuators,
            values=self._motors.values(self._sent, self._supply),
            interface=self.info.interface,
            enabled=np.full(len(self._sent), self._enabled),
        )

    def _who(self, servo: int) -> str:
        return f'servo {servo} ({self._names[servo]})'

    def _said(self, error: int) -> str:
        """A hardware error in words."""
        bits = HARDWARE_ERRORS[self.line.family]
        known = [text for bit, text in bits.items() if error & bit]
        return ', '.join(known) or f'hardware error {error}'
