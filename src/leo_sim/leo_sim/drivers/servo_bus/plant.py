# SPDX-License-Identifier: Apache-2.0
"""The robot behind the servos: their registers drive it, and it is what they measure."""

from collections.abc import Mapping

import numpy as np

from leo_sim.description.robot_file import ServoFile
from leo_sim.description.servos import servo_model, TICKS
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.servo_bus.feetech import FeetechServo
from leo_sim.drivers.servo_bus.servo import Servo
from leo_sim.drivers.simulated import SimulatedDriver

SLICE = 0.005  # longest time it is integrated at once [s]
SUPPLY_ERROR = 0x01


class Plant(SimulatedDriver):
    """A simulated robot whose motors are driven by the registers of servos.

    Where it takes goals, the servos' own loops are part of its model, on the supply of now. With a
    `hand` somebody holds the robot in its start pose until a motor is driven.

    Attributes:
        servos: by joint.
        volts: what is on each motor, V (N m of a torque-driven robot, the goal [rad] of one that
            follows goals), NaN where free, (A,).
        supply: voltage at the servos [V]: `open_circuit` less what `supply_resistance` takes.
    """

    def __init__(
        self, options: DriverOptions, supply: float, supply_resistance: float, hand: bool = False
    ) -> None:
        super().__init__(options)
        self.robot = options.robot
        bus, self.family = options.robot.driver.bus, options.robot.driver.family
        assert bus is not None
        kind = FeetechServo if self.family == 'feetech' else Servo
        self._files: Mapping[str, ServoFile] = bus.servos
        self.servos = {
            joint: kind(file.id, servo_model(file.model, self.family))
            for joint, file in bus.servos.items()
        }
        self.open_circuit = self.supply = supply
        self.supply_resistance = supply_resistance
        self.seconds = 0.0
        self._hand = self._held = hand
        self.volts = self._duty = np.zeros(len(self.info.actuators))
        self._loops = self._model.laws.servos
        if self._loops is not None:
            nominal = np.array([actuator.supply for actuator in self.robot.actuators])
            self._share = self._loops.loop.supply / nominal
        for servo in self.servos.values():
            servo.set('max_voltage_limit', round(13.0 * supply))
            servo.set('min_voltage_limit', round(7.0 * supply))
        for joint in self.info.actuators if self.info.goals is not None else ():
            servo = self.servos[joint]
            gain = self.robot.constants[f'actuators.{joint}.position_gain'].value
            if servo.model.gain_unit:
                servo.set('position_p_gain', round(gain / servo.model.gain_unit))
        self.measure()

    def run_to(self, seconds: float) -> None:
        while seconds - self.seconds > 1e-6:
            self.drive()
            driving = self._input if self.info.goals is None else self._enabled  # goal 0 is one
            if self._held and not driving.any():
                self.seconds = seconds
                break
            self._held = False
            step = min(SLICE, seconds - self.seconds)
            self._state = self._model.step(self._state, self._input, step, enabled=self._enabled)
            self.seconds += step
            self._sag()
        self.measure()

    def start_in(self, pose: str) -> None:
        super().start_in(pose)
        self._held = self._hand

    def drive(self) -> None:
        for k, joint in enumerate(self.info.actuators):
            servo = self.servos[joint]
            value = self._value(joint, servo) if servo.get('torque_enable') else None
            self._enabled[k] = value is not None
            self._input[k] = value or 0.0
        self.volts = np.where(self._enabled, self._input, np.nan)

    def measure(self) -> None:
        """Put what the sensors say into the registers; a supply out of range is an error."""
        q, dq = self._model.sense(self._state)
        if self._loops is not None:  # of motors that follow goals, -1 to 1
            duty = self._loops.duty(self._input, self._state.q, self._state.dq)
            self._duty = np.where(self._enabled, duty, 0.0)
        currents, tenths = self._currents(dq), round(10.0 * self.supply)
        for k, joint in enumerate(self.info.joints):
            servo, file = self.servos[joint], self._files[joint]
            count = file.zero + round(file.ratio * float(q[k]) / servo.model.angle_unit)
            servo.set('present_position', count % servo.model.turn if servo.model.turn else count)
            servo.set('present_velocity', round(file.ratio * float(dq[k]) / servo.model.rate_unit))
            servo.set('present_input_voltage', tenths)
            if not servo.get('min_voltage_limit') <= tenths <= servo.get('max_voltage_limit'):
                servo.fail(SUPPLY_ERROR)
            if self.family == 'dynamixel':
                begun = k / len(self.info.joints)
                servo.set('realtime_tick', int(1e3 * self.seconds + begun) % TICKS)
            servo.set('present_pwm', self._pwm(joint, servo))
            if servo.model.current_unit and joint in currents:
                current = file.direction * currents[joint]
                servo.set('present_current', round(current / servo.model.current_unit))

    def _value(self, joint: str, servo: Servo) -> float | None:
        """What a servo puts on its motor: V, N m or a goal [rad]; None leaves it free."""
        file, kind = self._files[joint], self.robot.input
        if kind == 'position':
            if (goal := servo.goal) is None:
                return None
            return (goal - file.zero) * servo.model.angle_unit / file.ratio
        if servo.pwm is not None and kind == 'voltage':
            return file.direction * servo.pwm * self.supply
        if servo.current is not None and file.torque_constant is not None:
            return file.direction * servo.current * file.torque_constant.value
        return 0.0

    @property
    def _on_motors(self) -> np.ndarray:
        return self._input if self._loops is None else self._duty * self.supply

    def _pwm(self, joint: str, servo: Servo) -> int:
        if not servo.get('torque_enable') or joint not in self.info.actuators:
            return 0
        if servo.goal is None:
            return servo.get('goal_pwm') if servo.pwm is not None else 0
        duty = float(self._duty[self.info.actuators.index(joint)])
        return self._files[joint].direction * round(duty * servo.model.pwm_of_supply)

    def _currents(self, dq: np.ndarray) -> dict[str, float]:
        found, volts = {}, self._on_motors
        for k, actuator in enumerate(self.robot.actuators):
            servo, file = self.servos[actuator.joint], self._files[actuator.joint]
            if not self._enabled[k]:
                found[actuator.joint] = 0.0
            elif actuator.torque_constant and actuator.resistance:
                emf = actuator.torque_constant * dq[self.robot.actuated[k]]
                found[actuator.joint] = float(volts[k] - emf) / actuator.resistance
            else:
                found[actuator.joint] = file.direction * (servo.current or 0.0)
        return found

    def _sag(self) -> None:
        """The supply under the load of the motors, each of which draws volts x amperes."""
        currents = self._currents(self._model.sense(self._state)[1]).values()
        power = sum(abs(float(u) * i) for u, i in zip(self._on_motors, currents, strict=True))
        self.supply = self.open_circuit - self.supply_resistance * power / self.open_circuit
        if self._loops is not None:
            self._loops.loop = self._loops.loop._replace(supply=self._share * self.supply)
