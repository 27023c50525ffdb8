# SPDX-License-Identifier: Apache-2.0
"""Servos on a bus as a robot, whoever made them: volts as PWM of the measured supply, or goals.

Where it stops by itself it leaves 0 V on motors that are on: they brake. Motors that follow goals
are freed. A servo that shuts itself down, and /robot/torque false, leave a motor free. See
docs/your_driver.md.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_sim.description.servos import HARDWARE_ERRORS, MODES, servo_model
from leo_sim.drivers import base
from leo_sim.drivers.servo_goals import GoalUnits
from leo_sim.drivers.servo_joints import DriveUnits, farthest, JointUnits, MotorUnits, pose_of
from leo_sim.drivers.servo_line import Blocks, ServoLine
from leo_sim.drivers.servo_port import latency_file, latency_timer

SHARE = 0.4  # share of a period [s] that an answer may take on top of its bytes
NEAR = 0.15  # a joint so close to its start pose is in it [rad or m]
LEAST_SUPPLY = 3.0  # no servo works below this [V]


class ServoDriver(ABC):
    """Servos on one bus, one for every joint; those without an actuator are read only.

    What a protocol has of its own is in the subclasses: how a servo is made ready, and how it is
    known that an answer is fresh and that a servo is well. What an input has of its own, volts or
    goals, is in its MotorUnits.
    """

    line: ClassVar[type[ServoLine]]
    first: ClassVar[str]
    last: ClassVar[str]  # the block of registers that is read each period
    ready: ClassVar[tuple[tuple[str, int], ...]]  # what is written to each before it is asked
    alert: ClassVar[int]  # bits of a status's error by which a servo says that something is wrong

    def __init__(self, options: base.DriverOptions) -> None:
        robot = options.robot
        family, bus = self.line.family, robot.driver.bus
        if bus is None or robot.driver.family != family:
            raise UserError(
                f'{robot.name} has no servos: give it some in robot.yaml, driver: '
                f'{family} (docs/your_driver.md)'
            )
        kind = GoalUnits if robot.input == 'position' else DriveUnits
        self._joints = JointUnits(robot, bus)
        self._motors: MotorUnits = kind(robot, bus)
        info = base.robot_info(robot, options.state_rate, own_clock=False)
        self.info = replace(info, goals=self._motors.goals)
        self.starts = 0
        self._models = {s.id: servo_model(s.model, family) for s in bus.servos.values()}
        self._path, self._baud = options.port or bus.port, bus.baud
        self._computer = options.computer
        names = {servo.id: joint for joint, servo in bus.servos.items()}
        self._bus = self.line(self._path, bus.baud, names, self._computer)
        self._actuated = list(robot.actuated)
        self._pose = pose_of(robot, options.start)
        self._angles = np.full(len(self.info.joints), np.nan)
        ids = self._ids = self._motors.ids
        self._sent = np.zeros(len(ids), dtype=int)
        self._enabled, self._on = True, np.zeros(len(ids), dtype=bool)
        self._on_at_rest = np.isfinite(self.info.rest)
        self._angle = self._rate = self._supply = np.zeros(len(ids))
        self._conditions: dict[int, str] = {}
        self._readings: base.Readings | None = None
        self._findings = base.Findings()
        self._cycle = 0.0
        name, value = self._motors.rest
        self._rest = self._bus.packet(name, dict.fromkeys(ids, value))
        goals = self._bus.packet(self._motors.goal, dict.fromkeys(ids, 0))
        self._on_its_way = self._bus.seconds(len(goals))
        self._from = self._bus.earlier(self.first, self._motors.shown)

    def connect(self) -> None:
        """Open the bus, check every servo, and leave the motors at 0, or free without a goal."""
        self._bus.open()
        try:
            self._make_ready()
        except (UserError, base.DriverFault, OSError):
            self._bus.close()
            raise

    def _make_ready(self) -> None:
        for servo in self._joints.ids:
            self._greet(servo)
            for name, value in (('torque_enable', 0), *self.ready, ('return_delay_time', 0)):
                self._bus.set(servo, name, value)
        for servo in self._ids:
            self._prepare(servo)
            self._bus.set(servo, 'operating_mode', MODES[self.line.family][self._motors.goal])
        volts = [self._bus.get(servo, 'present_input_voltage') for servo in self._ids]
        self._supply = 0.1 * np.array(volts)
        found = self._motors.learn(self._bus, self._supply)
        timer = latency_timer(self._path)
        if timer is not None and timer > 1:
            file = latency_file(self._path)
            late = f'{self._path} keeps bytes back for {timer} ms: echo 1 | sudo tee {file}'
            found = replace(found, differs=(late, *found.differs))
        self._findings = found
        self._switch(self._on_at_rest)
        self._bus.wait_at_most(max(SHARE / self.info.state_rate, 1e-3 * ((timer or 1) + 2)))

    def read(self) -> JointStates:
        """All servos with one instruction, stamped when they measured.

        An answer that is missing, damaged or of an earlier reading, or a last command that did not
        arrive, is a TransientFault; a servo that has let go a DriverFault.
        """
        began = self._computer.monotonic()
        sent, blocks = self._bus.sync_read(self._joints.ids, self._from, self.last)
        self._check_fresh(sent, blocks)
        angles, rates = self._joints.angles(blocks), self._joints.rates(blocks)
        self._angles = angles
        self._angle, self._rate = angles[self._actuated], rates[self._actuated]
        self._note(blocks)
        self._check_alerts(blocks)
        self._check_taken(blocks)
        now = self._computer.monotonic()
        self._cycle = now - began
        measured = self._measured(sent, now, blocks)
        stamp_ns = self._computer.time_ns() - round((now - measured) * 1e9)
        return JointStates(stamp_ns, self.info.joints, angles, rates)

    def write(self, values: np.ndarray) -> Applied:
        """All motors with one instruction, NaN frees one; what its counts are, at this supply.

        One that was free begins where it is, and follows from the next call on.
        """
        wanted = self._enabled & np.isfinite(values)
        begun = self._switch(wanted)
        allowed = self._motors.allowed(np.where(wanted, values, 0.0), self._angle, self._rate)
        self._sent = np.where(wanted, self._motors.counts(allowed, self._supply), 0)
        self._sent[list(begun)] = list(begun.values())
        each = zip(self._ids, self._sent, wanted, strict=True)
        goals = {servo: int(count) for servo, count, on in each if on}
        if goals:
            self._bus.sync_write(self._motors.goal, goals)
        return self._applied()

    def halt(self) -> Applied:
        """All motors to 0, or free; twice since nobody answers. Other calls may wait meanwhile."""
        self._sent = np.zeros_like(self._sent)
        self._on = self._on & self._on_at_rest
        self._bus.send(self._rest)
        self._bus.send(self._rest)
        return self._applied()

    def advance(self, seconds: float) -> float:
        return seconds

    def set_torque(self, on: bool) -> None:
        """Motors on at 0, those of goals from the next goal on; or free."""
        self.halt()
        self._enabled = on
        self._switch(on & self._on_at_rest)

    def _switch(self, wanted: np.ndarray) -> dict[int, int]:
        """Free the motors that are not wanted; torque comes on, where it was off, without a move.

        That motors are free is not answered for, and said again with each write. Returns the
        goals of those whose torque came on, by number.
        """
        free = [n for n, on in zip(self._ids, wanted, strict=True) if not on]
        if free:
            self._bus.sync_write('torque_enable', dict.fromkeys(free, 0))
        begun = {}
        for k in np.flatnonzero(wanted & ~self._on):
            servo = self._ids[k]
            begun[int(k)] = self._motors.begin(self._bus, servo)
            self._bus.set(servo, self._motors.goal, begun[int(k)])
            self._bus.set(servo, 'torque_enable', 1)
        self._on = wanted.copy()
        return begun

    def reset(self) -> None:
        joint, off = farthest(self._pose, self.info.joints, self._angles)
        if off > NEAR:
            raise base.NotPossible(
                f'put it into its start pose by hand: {joint} is {off:.2f} off; '
                '/robot/torque false frees it'
            )
        self.starts += 1

    def stop(self) -> None:
        """0 V, motors on: they brake. Those of goals are freed."""
        if not self._bus.is_open:
            return
        try:
            self.halt()
        finally:
            self._bus.close()

    def readings(self) -> base.Readings | None:
        return self._readings

    def findings(self) -> base.Findings:
        return self._findings

    def figures(self) -> Mapping[str, str]:
        timer = latency_timer(self._path)
        return {
            'port': self._path,
            'bus read ms': f'{1e3 * self._cycle:.2f}',
            'usb latency timer ms': 'none' if timer is None else str(timer),
        }

    def _greet(self, servo: int) -> None:
        model, found = self._models[servo], self._bus.ping(servo)
        who = self._bus.who(servo)
        if found is None:
            raise UserError(
                f'{who} does not answer on {self._path} at {self._baud} baud; '
                'look at its supply, its cable, its id and its baud rate'
            )
        if found != model.number:
            raise UserError(
                f'{who} is of model number {found}, robot.yaml says {model.name} ({model.number})'
            )
        if error := self._bus.get(servo, 'hardware_error_status'):
            raise UserError(
                f'{who} has stopped itself: {self._said(error)}; mend that, then '
                'switch its supply off and on'
            )

    def _note(self, blocks: Blocks) -> None:
        own = [blocks[servo] for servo in self._ids]
        self._supply = 0.1 * np.array([block.get('present_input_voltage') for block in own])
        if self._supply.min() < LEAST_SUPPLY:
            raise base.TransientFault(f'a servo measures a supply of {self._supply.min():.1f} V')
        self._readings = base.Readings(
            supply=float(np.median(self._supply)),
            current=self._motors.currents(blocks),
            temperature=np.array([block.get('present_temperature') for block in own]),
            condition=tuple(self._conditions.get(servo, '') for servo in self._ids),
        )

    def _measured(self, sent: float, answered: float, blocks: Blocks) -> float:
        """When the servos measured [s]: when they were asked, unless they have clocks."""
        return sent

    @abstractmethod
    def _prepare(self, servo: int) -> None:
        """Make a servo with an actuator, whose motor is free, ready to be driven."""

    @abstractmethod
    def _check_fresh(self, sent: float, blocks: Blocks) -> None:
        """Raise TransientFault where an answer is of an earlier reading."""

    def _check_taken(self, blocks: Blocks) -> None:
        for servo, sent, on in zip(self._ids, self._sent, self._on, strict=True):
            taken = self._motors.taken(blocks[servo], sent)
            if on and not (taken and not self._motors.seems_free(blocks[servo])):
                self._check_on(servo)
                if not taken:
                    raise base.TransientFault(
                        f'{self._bus.who(servo)} has not taken the last command'
                    )

    def _check_on(self, servo: int) -> None:
        if not self._bus.get(servo, 'torque_enable'):
            raise base.DriverFault(
                f'{self._bus.who(servo)} is free though nobody asked: it was '
                'restarted, or its supply failed; start the robot again'
            )

    def _check_alerts(self, blocks: Blocks) -> None:
        for servo, block in blocks.items():
            if not block.error & self.alert:
                self._conditions.pop(servo, None)
            elif servo not in self._conditions:
                error = self._bus.get(servo, 'hardware_error_status')
                self._conditions[servo] = self._said(error)
                if error & self._bus.get(servo, 'shutdown'):
                    raise base.DriverFault(
                        f'{self._bus.who(servo)} has let go: {self._said(error)}; it is free, the '
                        f'others {self._motors.at_rest}; mend that, then switch its supply off '
                        'and on'
                    )

    def _applied(self) -> Applied:
        stamp_ns = self._computer.time_ns() + round(1e9 * self._on_its_way)
        values = np.where(self._on, self._motors.values(self._sent, self._supply), 0.0)
        info = self.info
        return Applied(stamp_ns, info.actuators, values, info.interface, self._on.copy())

    def _said(self, error: int) -> str:
        known = [text for bit, text in HARDWARE_ERRORS[self.line.family].items() if error & bit]
        return ', '.join(known) or f'hardware error {error}'
