# SPDX-License-Identifier: Apache-2.0
"""Goals [rad] as counts of position servos, and whether the servos are as robot.yaml says."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.description.constants import Constant
from leo_sim.description.robot import Robot
from leo_sim.description.robot_file import BusFile
from leo_sim.description.servos import FAR
from leo_sim.drivers.base import Findings
from leo_sim.drivers.servo_joints import Array, column, MotorUnits
from leo_sim.drivers.servo_line import Block, ServoLine
from leo_sim.drivers.servo_loop import misfits, OwnLoop, WORDS

OFF_GOAL = 3  # a servo farther from its goal, counts, has some duty while its torque is on


class GoalUnits(MotorUnits):
    """Goals of position servos, which follow them by a loop of their own.

    Before the first goal, and where a driver stops, the motors are free.
    """

    goal = shown = 'goal_position'
    goals: Array
    rest = 'torque_enable', 0
    at_rest = 'are freed'

    def __init__(self, robot: Robot, bus: BusFile) -> None:
        super().__init__(robot, bus)
        for name, servo in zip(self._names, self._servos, strict=True):
            if servo.current_limit is not None:
                raise UserError(
                    f'{robot.name}: {name} has a current_limit, which nobody can keep '
                    'while the servo follows goals by itself; leave it out'
                )
        low, high = robot.bounds
        self.goals = np.array([np.maximum(low, self._low), np.minimum(high, self._high)])
        for name, (least, most) in zip(self._names, self.goals.T, strict=True):
            if least > most:
                raise UserError(
                    f'{robot.name}: low and high of the servo of {name} leave nothing '
                    'of what its limit and its stops allow'
                )
        self._zero = column(self._servos, 'zero')
        self._angle = column(self._models, 'angle_unit') / column(self._servos, 'ratio')
        self._reach = self._inside()

    def learn(self, bus: ServoLine, supply: Array) -> Findings:
        """Read the loop of each servo, in its mode by now; from then on it shapes no motion."""
        self._reach = self._inside()
        loops = [self._loop(k, bus) for k in range(len(self.ids))]
        lines: list[str] = []
        for k, loop in enumerate(loops):
            lines += self._narrowed(k, loop)
            lines += misfits(loop, self._meant(k), float(supply[k]))
            lines += self._shaped(k, bus, loop)
        return Findings({loop.who: str(loop) for loop in loops}, tuple(lines))

    def begin(self, bus: ServoLine, servo: int) -> int:
        """Torque comes on where the joint is: the goal in the servo is one of before."""
        low, high = self._reach[:, self.ids.index(servo)]
        return int(np.clip(bus.get(servo, 'present_position'), low, high))

    def allowed(self, wanted: Array, angle: Array, rate: Array) -> Array:
        return np.clip(wanted, *self.goals)

    def counts(self, values: Array, supply: Array) -> Array:
        return np.clip(np.rint(self._zero + values / self._angle).astype(int), *self._reach)

    def values(self, counts: Array, supply: Array) -> Array:
        return self._angle * (counts - self._zero)

    def seems_free(self, block: Block) -> bool:
        off = abs(block.get('goal_position') - block.get('present_position'))
        return off > OFF_GOAL and block.get('present_pwm') == 0

    def _inside(self) -> Array:
        low, high = np.sort(self._zero + self.goals / self._angle, axis=0)
        return np.array([np.ceil(low - 1e-6), np.floor(high + 1e-6)]).astype(int)

    def _profile(self, k: int) -> int:
        """Register profile_velocity: 0 is as fast as the servo can."""
        rate = self._meant(k).get('goal_rate')
        if rate is None:
            return 0
        return max(1, round(rate.value * self._servos[k].gear / self._models[k].rate_unit))

    def _loop(self, k: int, bus: ServoLine) -> OwnLoop:
        servo, model = self.ids[k], self._models[k]
        found = {name: bus.get(servo, name) for name in WORDS if name in model.registers}
        return OwnLoop(bus.who(servo), model, self._servos[k], found)

    def _meant(self, k: int) -> dict[str, Constant]:
        path = f'actuators.{self._names[k]}.'
        constants = self._robot.constants.items()
        return {name[len(path) :]: value for name, value in constants if name.startswith(path)}

    def _narrowed(self, k: int, loop: OwnLoop) -> Iterator[str]:
        own, turn = (-FAR, FAR), loop.model.turn
        if turn:
            own = loop.found['min_position_limit'], loop.found['max_position_limit']
            own = own if own[0] < own[1] else (0, turn - 1)
        low, high = self._reach[:, k]
        self._reach[:, k] = np.clip((low, high), *own)
        if low < own[0] - 1 or high > own[1] + 1:
            yield (
                f'{loop.who}: goals would be {low} to {high} counts, the servo takes '
                f'{own[0]} to {own[1]}; those beyond are cut. Look at zero, and at its '
                'homing offset and position limits'
            )

    def _shaped(self, k: int, bus: ServoLine, loop: OwnLoop) -> Iterator[str]:
        right = {'profile_acceleration': 0, 'profile_velocity': self._profile(k)}
        for name, count in right.items():
            bus.set(self.ids[k], name, count)
            if loop.found[name] not in (0, count):
                was = replace(loop, found={name: loop.found[name]})
                yield f"{loop.who}: its {was} is not robot.yaml's and was set to {count}"
