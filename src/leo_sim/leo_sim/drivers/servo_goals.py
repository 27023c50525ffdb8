# SPDX-License-Identifier: Apache-2.0
"""Goals [rad] as counts of position servos, and whether the servos are as robot.yaml says."""

from collections.abc import Iterator

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.description.robot_file import BusFile
from leo_sim.drivers.servo_joints import Array, column, MotorUnits
from leo_sim.drivers.servo_line import Block, ServoLine

FAR = 1_048_575
"""Counts either way that a servo takes whose count goes on over a turn (e-Manual, X series)."""
NEAR = 0.02  # a gain this close to that of robot.yaml is the same, as a share of it
NEAR_SUPPLY = 0.1  # so is a supply, which a battery does not keep
OFF_GOAL = 3  # a servo farther from its goal, counts, has some duty while its torque is on


class GoalUnits(MotorUnits):
    """Goals of position servos, which follow them by a loop of their own.

    Before the first goal, and where a driver stops, the motors are free.
    """

    goal = shown = 'goal_position'
    rest = 'torque_enable', 0
    at_rest = 'are freed'
    holds = True

    def __init__(self, robot: Robot, bus: BusFile) -> None:
        super().__init__(robot, bus)
        for name, servo in zip(self._names, self._servos, strict=True):
            if servo.current_limit is not None:
                raise UserError(
                    f'{robot.name}: {name} has a current_limit, which nobody can keep '
                    'while the servo follows goals by itself; leave it out'
                )
        self.nothing = np.full(len(self.ids), np.nan)
        low, high = robot.bounds
        self.goals = np.array([np.maximum(low, self._low), np.minimum(high, self._high)])
        for name, (least, most) in zip(self._names, self.goals.T, strict=True):
            if least > most:
                raise UserError(
                    f'{robot.name}: low and high of the servo of {name} leave nothing '
                    'of what its limit and its stops allow'
                )
        turn = self._direction * column(self._servos, 'gear')
        self._zero = column(self._servos, 'zero')
        self._angle = column(self._models, 'angle_unit') / turn
        self._reach = self._inside()

    def settings(self, servo: int) -> dict[str, int]:
        """The mode; the servo follows at once, or as fast as robot.yaml's goal_rate says."""
        return super().settings(servo) | {
            'profile_acceleration': 0,
            'profile_velocity': self._profile(self.ids.index(servo)),
        }

    def learn(self, bus: ServoLine, supply: Array) -> list[str]:
        """Read the range of each servo; what differs from robot.yaml in range, gains, supply."""
        self._reach = self._inside()
        lines = [line for k in range(len(self.ids)) for line in self._narrowed(k, bus)]
        for k, volts in enumerate(supply):
            lines += self._misfits(k, bus, float(volts))
        return lines

    def begin(self, bus: ServoLine, servo: int) -> int:
        """Torque comes on where the joint is: the goal in the servo is one of before."""
        low, high = self._reach[:, self.ids.index(servo)]
        return int(np.clip(bus.get(servo, 'present_position'), low, high))

    def allowed(self, wanted: Array, angle: Array, rate: Array) -> Array:
        """Goals [rad], (A,), within what robot.yaml and the stops allow."""
        assert self.goals is not None
        return np.clip(wanted, *self.goals)

    def counts(self, values: Array, supply: Array) -> Array:
        """The goal register for goals [rad], (A,)."""
        return np.clip(np.rint(self._zero + values / self._angle).astype(int), *self._reach)

    def values(self, counts: Array, supply: Array) -> Array:
        """The goals [rad], (A,), of goal registers."""
        return self._angle * (counts - self._zero)

    def seems_free(self, block: Block) -> bool:
        """Whether it is off its goal without any duty."""
        off = abs(block.get('goal_position') - block.get('present_position'))
        return off > OFF_GOAL and block.get('present_pwm') == 0

    def _inside(self) -> Array:
        """Lowest and highest count that is no goal outside `goals`, (2, A)."""
        assert self.goals is not None
        low, high = np.sort(self._zero + self.goals / self._angle, axis=0)
        return np.array([np.ceil(low - 1e-6), np.floor(high + 1e-6)]).astype(int)

    def _profile(self, k: int) -> int:
        """Register profile_velocity: 0 is as fast as the servo can."""
        rate = self._constant(k, 'goal_rate')
        if rate is None:
            return 0
        return max(1, round(rate * self._servos[k].gear / self._models[k].rate_unit))

    def _narrowed(self, k: int, bus: ServoLine) -> Iterator[str]:
        """Keep goals of a servo within the range it takes."""
        servo, turn = self.ids[k], self._models[k].turn
        own = (-FAR, FAR)
        if turn:
            own = bus.get(servo, 'min_position_limit'), bus.get(servo, 'max_position_limit')
            own = own if own[0] < own[1] else (0, turn - 1)
        low, high = self._reach[:, k]
        self._reach[:, k] = np.clip((low, high), *own)
        if low < own[0] - 1 or high > own[1] + 1:
            yield (
                f'{bus.who(servo)}: goals would be {low} to {high} counts, the servo takes '
                f'{own[0]} to {own[1]}; those beyond are cut. Look at zero, and at its '
                'homing offset and position limits'
            )

    def _misfits(self, k: int, bus: ServoLine, volts: float) -> Iterator[str]:
        """What of a servo's loop is not as robot.yaml says."""
        servo, model, who = self.ids[k], self._models[k], bus.who(self.ids[k])
        counts = bus.get(servo, 'position_p_gain')
        gain = model.gain_unit * counts
        if gain and self._differs(k, 'position_gain', gain, NEAR):
            yield (
                f'{who}: its P gain {counts} is a position_gain of {gain:.4g} 1/rad, '
                f'robot.yaml says {self._constant(k, "position_gain"):.4g}; mend one of them'
            )
        if counts := bus.get(servo, 'position_i_gain'):
            yield f'{who}: its I gain is {counts}, which the model has not; set it to 0'
        if (counts := bus.get(servo, 'pwm_limit')) < model.pwm_of_supply:
            yield (
                f'{who}: its duty is limited to {counts / model.pwm_of_supply:.0%}, which the '
                'model does not know'
            )
        if self._differs(k, 'supply', volts, NEAR_SUPPLY):
            yield (
                f'{who} measures a supply of {volts:.1f} V, robot.yaml says '
                f'{self._constant(k, "supply"):.4g}; its loop asks for shares of it'
            )

    def _differs(self, k: int, key: str, value: float, share: float) -> bool:
        """Whether a constant of robot.yaml is another, and not uncertain enough for this one."""
        constant = self._robot.constants[f'actuators.{self._names[k]}.{key}']
        low, high = constant.uncertain or (constant.value, constant.value)
        return not low * (1.0 - share) <= value <= high * (1.0 + share)

    def _constant(self, k: int, key: str) -> float | None:
        found = self._robot.constants.get(f'actuators.{self._names[k]}.{key}')
        return None if found is None else found.value
