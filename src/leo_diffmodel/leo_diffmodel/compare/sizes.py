# SPDX-License-Identifier: Apache-2.0
"""Typical sizes of a robot: what its motors can give, what its links weigh."""

from __future__ import annotations

import math

import numpy as np

from leo_sim.description.constants import BODY_UNITS, COM
from leo_sim.description.robot import Actuator, Robot

EARTH = 9.81
"""m/s2."""
SMALLEST = 1e-3
"""m: no link is smaller."""


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


def is_slide(robot: Robot, joint: str) -> bool:
    """Whether a joint slides (m, N) rather than turns (rad, N m)."""
    return joint in robot.slides


def length_unit(robot: Robot, joint: str) -> str:
    """Of a joint's position: rad, or m for a slide."""
    return 'm' if is_slide(robot, joint) else 'rad'


def torque_unit(robot: Robot, joint: str) -> str:
    """Of the torque at a joint: N m, or N for a slide."""
    return 'N' if is_slide(robot, joint) else 'N m'


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
    """What counts as a large torque or force at each joint, (J,) [N m, N]: slides carry all."""
    weight = _gravity(robot) * sum(link.body.mass for link in robot.links)
    turn = torque_scale(robot)
    return np.array([weight if is_slide(robot, j) else turn for j in robot.joint_names])


def gravity_scale(robot: Robot) -> float:
    """The largest weight of a moving link times its extent [N m]; never 0."""
    mass = {link: robot.constants[f'links.{link}.mass'].value for link in robot.moving_links}
    return _gravity(robot) * max(mass[link] * _extent(robot, link) for link in mass)


def inertia_scale(robot: Robot) -> float:
    """The largest inertia of a link about its own joint [kg m2]."""
    values = {path: c.value for path, c in robot.constants.items()}
    return max(_inertia(values, f'links.{link}.') for link in robot.moving_links)


def reach(robot: Robot) -> float:
    """Longest way from the base through the links' frames to the end of a link's extent [m].

    Slides with stops are run out.
    """
    far = {robot.joints[0].parent: 0.0}
    for joint in robot.joints:
        stop = max(map(abs, joint.limits)) if joint.name in robot.slides else 0.0
        far[joint.child] = (
            far[joint.parent]
            + float(np.linalg.norm(joint.translation))
            + (stop if math.isfinite(stop) else 0.0)
        )
    return max(far[joint.child] + _extent(robot, joint.child) for joint in robot.joints)


def mass_scale(robot: Robot) -> float:
    """Mass of the heaviest moving link [kg]."""
    return max(robot.constants[f'links.{link}.mass'].value for link in robot.moving_links)


def _strongest(robot: Robot, joints: list[str]) -> float:
    return max((stall_torque(robot, joint) or 0.0 for joint in joints), default=0.0)


def _gravity(robot: Robot) -> float:
    """What weights are told by [m/s2]: Earth's for a robot that lies flat."""
    return robot.constants['gravity'].value or EARTH


def _extent(robot: Robot, link: str) -> float:
    """How far the mass of a link is from its joint [m].

    The distance of its centre of mass, or its radius of gyration: of a wheel the first is 0.
    """
    values = {key: robot.constants[f'links.{link}.{key}'].value for key in BODY_UNITS}
    gyration = math.sqrt(values['inertia'] / values['mass']) if values['mass'] else 0.0
    return max(math.hypot(*(values[key] for key in COM)), gyration, SMALLEST)


def _inertia(values: dict[str, float], path: str) -> float:
    com = np.array([values[path + key] for key in COM])
    return float(values[path + 'inertia'] + values[path + 'mass'] * com @ com)


def _torque_per_input(actuator: Actuator) -> float:
    if actuator.torque_constant is None or actuator.resistance is None:
        return 1.0
    return actuator.torque_constant / actuator.resistance


def _actuator(robot: Robot, joint: str) -> Actuator | None:
    return next((a for a in robot.actuators if a.joint == joint), None)
