# SPDX-License-Identifier: Apache-2.0
"""States of a robot: the start poses, drawn and put on the ground; whether arrays can be one."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from leo_msgs_py.errors import UserError
from leo_sim.common.broadcasting import Array
from leo_sim.description.robot import Robot
from leo_sim.kinematics.gait import Gait

SLACK = 0.1
"""How far beyond a stop a measured state may be, rad or m: noise, and a stop that gives."""


@dataclass(frozen=True)
class State:
    """The state of a model."""

    q: np.ndarray  # true joint angles rad (m for slides), (J,), never wrapped
    dq: np.ndarray  # true joint rates rad/s, (J,)
    # what effects remember: past commands, lag, play. Empty = at rest, 0 V before
    memory: Mapping[str, np.ndarray] = field(default_factory=dict)


def start_pose(
    robot: Robot, name: str, rng: np.random.Generator, gait: Gait | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Angles and rates (J,) of a start pose, with its ranges drawn; UserError: unknown pose.

    The gait is that of a robot with a ground, which a pose `on_ground` touches.
    """
    pose = robot.start_pose(name)
    q, dq = (
        np.array([_drawn(values.get(joint, 0.0), rng) for joint in robot.joint_names])
        for values in (pose.angles, pose.rates)
    )
    if gait is not None and pose.on_ground:
        q[1] -= gait.clearance(q) / np.cos(gait.slope)
    return q, dq


def _drawn(value: Any, rng: np.random.Generator) -> float:
    return float(rng.uniform(*value)) if isinstance(value, tuple) else float(value)


def check_sizes(robot: Robot, q: Array, dq: Array, inputs: ArrayLike) -> None:
    """Raise UserError where a state or an input has not one number per joint or actuator."""
    names = robot.joint_names
    for what, values in (('angles', q), ('rates', dq)):
        if np.shape(values) != (len(names),):
            raise UserError(
                f'a state of {robot.name} has {len(names)} {what} '
                f'({", ".join(names)}), found {_shape(values)}'
            )
    if np.shape(inputs) != (len(robot.actuators),):
        motors = ', '.join(a.joint for a in robot.actuators)
        raise UserError(
            f'{robot.name} takes {len(robot.actuators)} inputs ({motors}), found {_shape(inputs)}'
        )


def check_possible(robot: Robot, q: Array, dq: Array) -> None:
    """Raise UserError for a number that is not finite or an angle outside its stops."""
    if not (np.isfinite(q).all() and np.isfinite(dq).all()):
        raise UserError(f'a state of {robot.name} has numbers that are not finite')
    moving = [joint for joint in robot.joints if joint.independent]
    for joint, angle in zip(moving, q, strict=True):
        low, high = joint.limits
        if not low - SLACK <= angle <= high + SLACK:
            unit = 'm' if joint.kind == 'prismatic' else 'rad'
            raise UserError(
                f'{robot.name}: {joint.name} is at {angle:.4g} {unit}, outside its '
                f'stops {low:.4g} to {high:.4g} {unit}'
            )


def outside(stops: tuple[Any, Any], q: Array) -> bool:
    """Whether angles (J,) are beyond stops (low, high) by more than the slack; false for NaN."""
    return bool(((q < stops[0] - SLACK) | (q > stops[1] + SLACK)).any())


def _shape(values: ArrayLike) -> str:
    shape = np.shape(values)
    return str(shape[0]) if len(shape) == 1 else f'an array of shape {shape}'
