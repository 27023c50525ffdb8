# SPDX-License-Identifier: Apache-2.0
"""Between joints and servos: counts, signs, gears, volts, and what a joint may be asked for."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.description.robot_file import BusFile
from leo_sim.description.servos import servo_model
from leo_sim.drivers.base import Findings
from leo_sim.drivers.servo_line import Block, Blocks, ServoLine

Array = np.ndarray

TOLERANCES = {'dynamixel': 0, 'feetech': 20}
"""How far the PWM that a servo shows may be from the one it was sent, counts: a Feetech servo
measures its duty."""


def column(rows: Sequence[Any], name: str) -> Array:
    return np.array([getattr(row, name) for row in rows])


class JointUnits:
    """Angles and rates of all joints from the counts of their servos; `ids` are in joint order."""

    def __init__(self, robot: Robot, bus: BusFile) -> None:
        servos = [bus.servos[joint] for joint in robot.joint_names]
        models = [servo_model(servo.model) for servo in servos]
        self.ids = [servo.id for servo in servos]
        self._counts = self._zero = column(servos, 'zero')
        self._turn = column(models, 'turn')
        self._angle = column(models, 'angle_unit') / column(servos, 'ratio')
        self._rate = column(models, 'rate_unit') / column(servos, 'ratio')

    def angles(self, blocks: Blocks) -> Array:
        """Of the joints [rad or m], (J,), continuous: no servo turns half round in a period.

        One whose counts begin anew each turn is within half a turn of its zero at first.
        """
        counts = np.array([blocks[n].get('present_position') for n in self.ids])
        half, turn = self._turn // 2, np.maximum(self._turn, 1)
        near = self._counts + (counts - self._counts + half) % turn - half
        self._counts = np.where(self._turn > 0, near, counts)
        return self._angle * (self._counts - self._zero)

    def rates(self, blocks: Blocks) -> Array:
        """Of the joints [rad/s or m/s], (J,)."""
        return self._rate * np.array([blocks[n].get('present_velocity') for n in self.ids])


class MotorUnits(ABC):
    """Inputs of actuators as a register of their servos, and back; `ids` are in actuator order."""

    goal: str  # the register that drives them
    shown: str  # the register that shows what a servo was sent; '' where none does
    tolerance: int = 0  # how far that may be from what was sent, counts
    rest: tuple[str, int]  # the register and value that stop a motor
    goals: Array | None = None  # lowest and highest [rad], (2, A); None where inputs are no goals
    at_rest: ClassVar[str]  # what becomes of the motors when the driver ends, in words

    def __init__(self, robot: Robot, bus: BusFile) -> None:
        self._robot = robot
        self._names = [actuator.joint for actuator in robot.actuators]
        self._servos = [bus.servos[name] for name in self._names]
        self._models = [servo_model(servo.model) for servo in self._servos]
        self.ids = [servo.id for servo in self._servos]
        self._direction = column(self._servos, 'direction')
        self._low, self._high = column(self._servos, 'low'), column(self._servos, 'high')
        self._full = column(self._models, 'pwm_of_supply')
        self._ampere = column(self._models, 'current_unit')

    @abstractmethod
    def learn(self, bus: ServoLine, supply: Array) -> Findings:
        """Read what the servos allow, at a supply [V], (A,)."""

    @abstractmethod
    def begin(self, bus: ServoLine, servo: int) -> int:
        """The goal at which a servo's torque comes on: nothing moves by that."""

    @abstractmethod
    def allowed(self, wanted: Array, angle: Array, rate: Array) -> Array:
        """What may be asked of the actuators [V, N m or rad], (A,), at angles and rates, (A,)."""

    @abstractmethod
    def counts(self, values: Array, supply: Array) -> Array:
        """The goal register for inputs (A,), at measured supply voltages [V], (A,)."""

    @abstractmethod
    def values(self, counts: Array, supply: Array) -> Array:
        """The inputs (A,) of goal registers, at measured supply voltages [V], (A,)."""

    def taken(self, block: Block, sent: int) -> bool:
        return not self.shown or abs(block.get(self.shown) - sent) <= self.tolerance

    def seems_free(self, block: Block) -> bool:
        return False

    def currents(self, blocks: Blocks) -> Array | None:
        """Currents [A] along the joints, (A,); None where a servo measures none."""
        if not self._ampere.all():
            return None
        counts = np.array([blocks[n].get('present_current') for n in self.ids])
        return self._direction * self._ampere * counts


class DriveUnits(MotorUnits):
    """Volts as PWM of the measured supply, torques as currents; at the end motors brake at 0."""

    at_rest = 'brake at 0 V'

    def __init__(self, robot: Robot, bus: BusFile) -> None:
        super().__init__(robot, bus)
        self.by_voltage = robot.input == 'voltage'
        self.goal = 'goal_pwm' if self.by_voltage else 'goal_current'
        self.shown = 'present_pwm' if self.by_voltage else ''
        self.tolerance = TOLERANCES[robot.driver.family]
        self.rest = self.goal, 0
        self.own_limits = np.full(len(self.ids), np.iinfo(np.int16).max)  # of servos, counts
        if not self.by_voltage and not self._ampere.all():
            raise UserError(
                f'{robot.name} is driven by torques, but {self._models[0].name} knows '
                'no current; give input: voltage, or other servos'
            )
        self._current_limit = np.array(
            [s.current_limit.value if s.current_limit else np.inf for s in self._servos]
        )
        constants = [servo.torque_constant for servo in self._servos]
        self._torque = np.array([constant.value if constant else np.nan for constant in constants])
        self._emf = np.array([a.torque_constant or np.nan for a in robot.actuators])
        self._ohm = np.array([a.resistance or np.nan for a in robot.actuators])
        self._strongest = column(robot.actuators, 'limit')

    def learn(self, bus: ServoLine, supply: Array) -> Findings:
        limit = 'pwm_limit' if self.by_voltage else 'current_limit'
        self.own_limits = np.array([bus.get(servo, limit) for servo in self.ids])
        return Findings()

    def begin(self, bus: ServoLine, servo: int) -> int:
        return 0

    def allowed(self, wanted: Array, angle: Array, rate: Array) -> Array:
        """Beyond its range a joint is driven back only; the current stays within its limit.

        Either only ever takes away: 0 stays 0.
        """
        low, high = self._within_current(rate)
        values = np.clip(wanted, np.minimum(low, 0.0), np.maximum(high, 0.0))
        outward = ((angle > self._high) & (values > 0.0)) | ((angle < self._low) & (values < 0.0))
        return np.where(outward, 0.0, values)

    def counts(self, values: Array, supply: Array) -> Array:
        counts = np.rint(values / self._per_count(supply)).astype(int)
        return np.clip(counts, -self.largest(supply), self.largest(supply))

    def values(self, counts: Array, supply: Array) -> Array:
        return counts * self._per_count(supply)

    def largest(self, supply: Array) -> Array:
        """Counts that stay within the limits of the robot and of the servos, (A,)."""
        within = np.floor(self._strongest / np.abs(self._per_count(supply)) + 1e-9).astype(int)
        return np.minimum(within, self.own_limits)

    def _per_count(self, supply: Array) -> Array:
        """V or N m a count, with the joint's sign."""
        if self.by_voltage:
            return self._direction * supply / self._full
        return self._direction * self._ampere * self._torque

    def _within_current(self, rate: Array) -> tuple[Array, Array]:
        if not np.isfinite(self._current_limit).any():
            return np.full_like(rate, -np.inf), np.full_like(rate, np.inf)
        if not self.by_voltage:
            largest = self._current_limit * self._torque
            return -largest, largest
        spread = self._current_limit * self._ohm
        return self._emf * rate - spread, self._emf * rate + spread


def pose_of(robot: Robot, name: str) -> dict[str, tuple[float, float]]:
    """Lowest and highest angle [rad or m] of each joint that a start pose names."""
    return {
        joint: drawn if isinstance(drawn, tuple) else (drawn, drawn)
        for joint, drawn in robot.start_pose(name).angles.items()
    }


def farthest(
    pose: Mapping[str, tuple[float, float]], joints: Sequence[str], angles: np.ndarray
) -> tuple[str, float]:
    """The joint that is farthest from a pose, and by how much [rad or m]; infinity unmeasured."""
    off = {
        joint: max(pose[joint][0] - angle, angle - pose[joint][1], 0.0)
        if np.isfinite(angle)
        else np.inf
        for joint, angle in zip(joints, angles, strict=True)
        if joint in pose
    }
    return max(off.items(), key=lambda item: item[1], default=('', 0.0))
