# SPDX-License-Identifier: Apache-2.0
"""The figures of a model whose laws are straight lines, read off the laws themselves."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.effects.base import Placed
from leo_sim.export.needs import DELAY, LAG, LATE, needs, SAME, slope_and_end
from leo_sim.laws.laws import Laws
from leo_sim.model.model import Model

SPEEDS = np.array([1.0, 2.0, 4.0])
"""Rates at which what grows with the rate is read off, rad/s (m/s): one for each power of it."""


@dataclass(frozen=True)
class Drives:
    """Of each actuator, (A,); the torque is gain u + bias - back_emf w."""

    gain: Any  # N m per unit of what is on the motor, V or N m
    back_emf: Any  # N m s/rad
    bias: Any  # N m
    most: Any  # on the motor, V or N m
    scale: Any  # what is on the motor for a command of 1 V or N m
    lag: Any  # time constant of the command, s; 0 for none
    delay: Any  # of the command, s


@dataclass(frozen=True)
class Figures:
    """Of each joint, (J,), without its actuator."""

    armature: Any  # kg m2
    damping: Any  # N m s/rad
    drag: Any  # with |rate| x rate, and with rate cubed, (2, J)
    friction: Any  # N m
    stiffness: Any  # N m/rad
    rest: Any  # of the spring, rad
    zero: Any  # what the encoder reads at angle 0, rad
    late: float  # how long ago what the sensors show was, s
    drives: Drives
    laws: Laws


def figures(model: Model) -> Figures:
    """The figures of a model whose laws are straight lines (see `held`)."""
    needed = [(placed, needs(placed, model.robot)) for placed in model.effects]
    slow = {name: [p for p, of in needed if name in of] for name in (LAG, DELAY, LATE)}
    kept = [p for p, of in needed if not of & slow.keys()]
    laws = model.changed(effects=kept).laws
    still, nothing = np.zeros(len(laws.joints)), np.zeros(len(laws.actuated_joints))

    def joint(q: float, dq: float) -> Any:
        off, rates = nothing.astype(bool), still + dq
        return still + laws.torques(still + q, rates, rates, nothing, off, still).joint

    at_rest = joint(0.0, 0.0)
    stiffness = at_rest - joint(1.0, 0.0)
    level = laws.torques(still, still, still, nothing, None, still).level
    sprung = stiffness > 0
    rest = np.where(sprung, at_rest / np.where(sprung, stiffness, 1.0), 0.0)
    bias = np.where(sprung, 0.0, at_rest)[laws.actuated]
    armature = still + laws.rotor_inertia
    slopes = [(at_rest - joint(0.0, speed)) / speed for speed in SPEEDS]
    powers = np.linalg.solve(np.vander(SPEEDS, increasing=True), slopes)
    damping, *drag = np.where(np.abs(powers) > SAME * np.max(np.abs(slopes), axis=0), powers, 0.0)
    friction = still if level is None else level
    zero = laws.sense(still, still, {})[0]
    drives = _drives(model.robot, laws, bias, slow[LAG], slow[DELAY])
    rubs = armature, damping, np.array(drag), friction
    late = sum(p.parameters['delay'] for p in slow[LATE])
    return Figures(*rubs, stiffness, rest, zero, late, drives, laws)


def _drives(robot: Robot, laws: Laws, bias: Any, *slow: list[Placed]) -> Drives:
    """Straight lines of the motors, whatever makes their input (a goal, of servos)."""
    motors = laws.straight
    still, ones = np.zeros(len(laws.joints)), np.ones(len(laws.actuated_joints))

    def motor(u: float, dq: float) -> Any:
        torque = motors.torques(still, still, still + dq, u * ones, None, still).motor
        return (still + torque)[laws.actuated]

    strongest = np.array([a.strongest for a in robot.actuators])
    scale, most = slope_and_end(
        lambda share: motors.command(share * strongest, None, {}, 1.0)[0], 1.0
    )
    zero = motor(0.0, 0.0)
    lines = motor(1.0, 0.0) - zero, zero - motor(0.0, 1.0)
    at = [[[p for p in of if a.joint in p.where] for a in robot.actuators] for of in slow]
    times = ([sum(sum(p.parameters.values()) for p in here) for here in of] for of in at)
    return Drives(*lines, bias, most, scale / strongest, *times)


def refuse_mimics(robot: Robot, what: str, about_urdf: str = '') -> None:
    if robot.copies:
        raise UserError(
            f'joint {robot.copies[0]!r} mimics another, which the {what} written '
            f'here does not hold; write a .urdf{about_urdf}'
        )


def nominal(robot: Robot) -> Mapping[str, float] | None:
    angles: Mapping[str, Any] = robot.start_poses['nominal'].angles
    return None if any(isinstance(angle, tuple) for angle in angles.values()) else angles


def strengths(robot: Robot, found: Figures) -> Any:
    """The torque of each motor at rest for the largest command, N m, (A,)."""
    drive = found.drives
    if robot.input == 'position':
        return drive.gain * drive.most
    return drive.gain * np.minimum(drive.scale * robot.limits, drive.most)


def loop_gains(found: Figures) -> tuple[Any, Any, Any]:
    """Of servos, (A,): torque for 1 rad off the goal and for 1 rad/s, N m; largest goal rate."""
    drive, servos = found.drives, found.laws.servos
    assert servos is not None
    each = drive.gain * drive.scale * servos.loop.supply
    loop = servos.loop
    return each * loop.gain, each * loop.rate_gain, np.broadcast_to(loop.goal_rate, each.shape)
