# SPDX-License-Identifier: Apache-2.0
"""Typical sizes of a robot: what motors give, what links weigh, what is large in a unit."""

from dataclasses import dataclass
import math

import numpy as np

from leo_diffmodel.compare.settings import COMPARE
from leo_msgs_py.errors import UserError
from leo_msgs_py.units import powers
from leo_sim.description.constants import BODY_UNITS, COM
from leo_sim.description.robot import Actuator, Robot
from leo_sim.effects import Parameter

EARTH = 9.81  # standard gravity [m/s2]
SYMBOLS = ('N', 'm', 's', 'rad', 'kg', 'V')
COUNTS = ('', '1', '1/turn', '1/m')
"""Units of plain numbers: shares, scales, how often in a turn (on a slide in 2 pi m)."""


def stall_torque(robot: Robot, joint: str) -> float | None:
    """Largest torque of the motor at a joint at rest [N m]; None where there is no motor."""
    actuator = _actuator(robot, joint)
    if actuator is None:
        return None
    goes = robot.input == 'position' and actuator.supply  # goals are no measure of a torque
    return (goes or actuator.limit) * _torque_per_input(actuator)


def in_volts(robot: Robot, joint: str, torque: float) -> float | None:
    """The voltage that gives a torque at rest [V]; None without a voltage-driven motor there."""
    actuator = _actuator(robot, joint)
    if actuator is None or actuator.torque_constant is None:
        return None
    return torque / _torque_per_input(actuator)


def free_speed(robot: Robot, joint: str) -> float | None:
    """Of a voltage-driven motor without load [rad/s]; None where there is none."""
    actuator = _actuator(robot, joint)
    if actuator is None or not actuator.torque_constant:
        return None
    return actuator.strongest / actuator.torque_constant


def length_unit(robot: Robot, joint: str) -> str:
    """Of a joint's position: rad, or m for a slide."""
    return 'm' if joint in robot.slides else 'rad'


def torque_unit(robot: Robot, joint: str) -> str:
    """Of the torque at a joint: N m, or N for a slide."""
    return 'N' if joint in robot.slides else 'N m'


def input_unit(robot: Robot, joint: str) -> str:
    """Of what is sent to a joint's motor."""
    own = {'position': length_unit, 'torque': torque_unit}.get(robot.input)
    return own(robot, joint) if own else robot.input_unit


def torque_scale(robot: Robot) -> float:
    """The largest motor torque, or else the largest of gravity about a link's joint [N m]."""
    turning = [a.joint for a in robot.actuators if a.joint not in robot.slides]
    return _strongest(robot, turning) or gravity_scale(robot)


def force_scale(robot: Robot) -> float:
    """The largest force of a motor on a slide [N]; 0 without one."""
    return _strongest(robot, [a.joint for a in robot.actuators if a.joint in robot.slides])


def push_scale(robot: Robot) -> np.ndarray:
    """A large torque or force at each joint, (J,) [N m, N]: slides carry the whole weight."""
    weight = _gravity(robot) * sum(link.body.mass for link in robot.links)
    turn = torque_scale(robot)
    return np.array([weight if j in robot.slides else turn for j in robot.joint_names])


def gravity_scale(robot: Robot) -> float:
    """The largest weight of a moving link times its extent [N m]; never 0."""
    links = robot.moving_links
    return _gravity(robot) * max(_body(robot, n)['mass'] * _extent(robot, n) for n in links)


def inertia_scale(robot: Robot) -> float:
    """The largest inertia of a link about its own joint [kg m2]."""
    return max(_inertia(robot, link) for link in robot.moving_links)


def reach(robot: Robot) -> float:
    """Longest way from the base to the end of a link's extent [m], slides with stops run out."""
    far = {robot.joints[0].parent: 0.0}
    for joint in robot.joints:
        stop = max(map(abs, joint.limits)) if joint.name in robot.slides else 0.0
        way = far[joint.parent] + float(np.linalg.norm(joint.translation))
        far[joint.child] = way + (stop if math.isfinite(stop) else 0.0)
    return max(far[joint.child] + _extent(robot, joint.child) for joint in robot.joints)


def mass_scale(robot: Robot) -> float:
    """Mass of the heaviest moving link [kg]."""
    return max(_body(robot, link)['mass'] for link in robot.moving_links)


def _strongest(robot: Robot, joints: list[str]) -> float:
    return max((stall_torque(robot, joint) or 0.0 for joint in joints), default=0.0)


def _gravity(robot: Robot) -> float:
    """By which weights are computed [m/s2]: Earth's for a robot that lies flat."""
    return robot.constants['gravity'].value or EARTH


def _extent(robot: Robot, link: str) -> float:
    """How far the mass of a link is from its joint [m].

    The distance of its centre of mass, or its radius of gyration: of a wheel the first is 0.
    """
    value = _body(robot, link)
    gyration = math.sqrt(value['inertia'] / value['mass']) if value['mass'] else 0.0
    return max(math.hypot(*(value[key] for key in COM)), gyration, COMPARE.smallest_extent)


def _inertia(robot: Robot, link: str) -> float:
    value = _body(robot, link)
    com = np.array([value[key] for key in COM])
    return float(value['inertia'] + value['mass'] * com @ com)


def _body(robot: Robot, link: str) -> dict[str, float]:
    return {key: robot.constants[f'links.{link}.{key}'].value for key in BODY_UNITS}


def _torque_per_input(actuator: Actuator) -> float:
    if actuator.torque_constant is None or actuator.resistance is None:
        return 1.0
    return actuator.torque_constant / actuator.resistance


def _actuator(robot: Robot, joint: str) -> Actuator | None:
    return next((a for a in robot.actuators if a.joint == joint), None)


@dataclass(frozen=True)
class UnitSizes:
    """What is large of each quantity; of seconds an angle at a rate, or a length at a speed."""

    torque: float  # N m
    rate: float  # rad/s
    angle: float  # rad
    force: float  # N
    speed: float  # m/s
    length: float  # m
    inertia: float  # kg m2
    mass: float  # kg
    input: float  # at a motor [V]

    def of(self, unit: str) -> float | None:
        """Large in a unit: torque / rate in N m s/rad; None where the unit has other symbols.

        With rad, or with N and m as N m, it is one of turning; otherwise one of sliding.
        """
        if unit in COUNTS:
            return 1.0
        if unit in ('kg m2', 'm/s2'):
            return self.inertia if unit == 'kg m2' else EARTH
        power = powers(unit.replace('Nm', 'N m'))
        if power.keys() - {*SYMBOLS, '1'}:
            return None
        n, m, s, rad, kg, v = (power.get(symbol, 0) for symbol in SYMBOLS)
        size = self.mass**kg * self.input**v
        if rad or m == n:
            size = size * self.torque**n * self.length ** (m - n)
            return size / self.rate**s / self.angle ** -(s + rad)
        return size * self.force**n / self.speed**s / self.length ** -(s + m)

    def large(self, effect: str, parameter: Parameter) -> float:
        """Large for a parameter: by its unit, else the span of its bounds; UserError without."""
        known = self.of(parameter.unit)
        if known is not None:
            return known
        if math.isfinite(parameter.high - parameter.low):
            return parameter.high - parameter.low
        raise UserError(
            f'{effect}.{parameter.name}: how large is large in {parameter.unit!r}? '
            f'Give it low and high, or a unit of {", ".join(SYMBOLS)}'
        )
