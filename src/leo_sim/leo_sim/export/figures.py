# SPDX-License-Identifier: Apache-2.0
"""The figures of a model whose laws are straight lines, read off the laws themselves."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.export.needs import slope_and_end
from leo_sim.laws.laws import Laws
from leo_sim.model.model import Model

LAG = 'actuator_lag'


@dataclass(frozen=True)
class Drives:
    """Of each actuator, (A,); the torque is gain u + bias - back_emf w."""

    gain: Any  # N m per unit of what is on the motor, V or N m
    back_emf: Any  # N m s/rad
    bias: Any  # N m
    most: Any  # on the motor, V or N m
    scale: Any  # what is on the motor for a command of 1 V or N m
    lag: Any  # time constant of the command, s; 0 for none


@dataclass(frozen=True)
class Figures:
    """Of each joint, (J,), without its actuator."""

    armature: Any  # kg m2
    damping: Any  # N m s/rad
    friction: Any  # N m
    stiffness: Any  # N m/rad
    rest: Any  # of the spring, rad
    zero: Any  # what the encoder reads at angle 0, rad
    drives: Drives
    laws: Laws


def figures(model: Model) -> Figures:
    """The figures of a model whose laws are straight lines (see `held`)."""
    laws = model.changed(effects=[p for p in model.effects if p.effect.name != LAG]).laws
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
    damping = at_rest - joint(0.0, 1.0)
    friction = still if level is None else level
    zero = laws.sense(still, still, {})[0]
    drives = _drives(model, laws, bias)
    return Figures(armature, damping, friction, stiffness, rest, zero, drives, laws)


def _drives(model: Model, laws: Laws, bias: Any) -> Drives:
    """Straight lines of the motors, whatever makes their input (a goal, of servos)."""
    robot, motors = model.robot, laws.straight
    still, ones = np.zeros(len(laws.joints)), np.ones(len(laws.actuated_joints))

    def motor(u: float, dq: float) -> Any:
        torque = motors.torques(still, still, still + dq, u * ones, None, still).motor
        return (still + torque)[laws.actuated]

    strongest = np.array([a.strongest for a in robot.actuators])
    scale, most = slope_and_end(
        lambda share: motors.command(share * strongest, None, {}, 1.0)[0], 1.0
    )
    lag = np.zeros(len(ones))
    for placed in model.effects:
        if placed.effect.name == LAG:
            lag[[a.joint in placed.where for a in robot.actuators]] = placed.parameters['tau']
    zero = motor(0.0, 0.0)
    lines = motor(1.0, 0.0) - zero, zero - motor(0.0, 1.0)
    return Drives(*lines, bias, most, scale / strongest, lag)


def refuse_mimics(robot: Robot, what: str, about_urdf: str = '') -> None:
    if robot.copies:
        raise UserError(
            f'joint {robot.copies[0]!r} mimics another, which the {what} written '
            f'here does not hold; write a .urdf{about_urdf}'
        )


def nominal(robot: Robot) -> Mapping[str, float] | None:
    """Angles of the nominal start pose, where it is one pose."""
    angles: Mapping[str, Any] = robot.start_poses['nominal'].angles
    return None if any(isinstance(angle, tuple) for angle in angles.values()) else angles


def strengths(robot: Robot, found: Figures) -> Any:
    """The torque of each motor at rest for the largest command, N m, (A,)."""
    drive = found.drives
    if robot.input == 'position':
        return drive.gain * drive.most
    return drive.gain * np.minimum(drive.scale * robot.limits, drive.most)


def loop_gains(found: Figures) -> tuple[Any, Any]:
    """Of position servos: torque for 1 rad off the goal and for 1 rad/s, N m, (A,) each."""
    drive, servos = found.drives, found.laws.servos
    assert servos is not None
    each = drive.gain * drive.scale * servos.loop.supply
    return each * servos.loop.gain, each * servos.loop.rate_gain
