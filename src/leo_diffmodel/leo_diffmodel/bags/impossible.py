# SPDX-License-Identifier: Apache-2.0
"""Values that no robot has: of a flipped bit, a forged message, a number that is another's.

What is a hundred times beyond what the robot can do, and as far beyond what its channel mostly
says, is left out. A whole channel in another unit stays, for `leo check` to say so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError

from .states import Floats, StateLog

if TYPE_CHECKING:
    from leo_sim.description.robot import Actuator, Robot

BEYOND = 100.0
"""Times what is possible. Motors are overdriven and joints are hit, but by less."""
ABSURD = 1e9
"""rad, rad/s, V, N m (m, m/s, N): a wheel at 3000 rad/s turns so far in four days, and no unit
that angles, rates or inputs are logged in makes so much of them."""
FAST = 100.0
"""rad/s, m/s: so fast a joint may be, whatever its motor."""
MOSTLY = 0.9


class Channel(NamedTuple):
    """A column of a recording: what it is, its unit, and the most that is possible in it."""

    name: str
    unit: str
    most: float


def without_impossible(states: StateLog, robot: Robot) -> tuple[StateLog, list[str]]:
    """Leave out states that no robot has; also return how many of which channel, in words.

    An effort alone becomes NaN, not measured.

    Raises:
        UserError: none is left.
    """
    seconds = float(np.ptp(states.stamp_ns)) * 1e-9
    positions, velocities, efforts = _channels(robot, seconds)
    out, told = impossible(states.q, positions)
    if states.dq is not None:
        fast, said = impossible(states.dq, velocities)
        out, told = out | fast, told + said
    if states.effort is not None:
        strong, said = impossible(states.effort, efforts)
        states, told = replace(states, effort=np.where(strong, np.nan, states.effort)), told + said
    keep = ~out.any(axis=1)
    if not keep.any():
        raise UserError(f'no joint state is left: {told[0]}; which unit is it in?')
    rows = ('log_ns', 'published_ns', 'stamp_ns', 'q', 'dq', 'effort')
    kept = {name: getattr(states, name) for name in rows}
    return replace(states, **{k: v[keep] for k, v in kept.items() if v is not None}), told


def input_channels(robot: Robot, kind: str) -> list[Channel]:
    """Inputs of a robot's actuators, in their order; `kind` is voltage, torque or position."""
    unit = {'voltage': 'V', 'torque': 'N m', 'position': 'rad'}[kind]
    most = {
        'voltage': [a.strongest for a in robot.actuators],
        'torque': [_stall(a) for a in robot.actuators],
        'position': [ABSURD] * len(robot.actuators),
    }[kind]
    return [
        Channel(f'inputs of {a.joint}', unit, m)
        for a, m in zip(robot.actuators, most, strict=True)
    ]


def lengths(robot: Robot) -> dict[str, str]:
    """Unit of each joint's position, in the robot's order: rad, of a slide m."""
    kinds = {joint.name: joint.kind for joint in robot.joints}
    return {name: 'm' if kinds[name] == 'prismatic' else 'rad' for name in robot.joint_names}


def impossible(values: Floats, channels: Sequence[Channel]) -> tuple[NDArray[np.bool_], list[str]]:
    """Say which values (N, C) no robot has, and how many of which channel, in words."""
    size = np.nan_to_num(np.abs(values), posinf=0.0)
    usual = np.quantile(size, MOSTLY, axis=0, method='lower')
    bound = np.minimum(ABSURD, BEYOND * np.maximum([c.most for c in channels], usual))
    beyond = size > bound
    return beyond, [
        f'{count} {channel.name} beyond {most:.3g} {channel.unit}, which no robot has; left out'
        for channel, count, most in zip(channels, beyond.sum(axis=0), bound, strict=True)
        if count
    ]


def _channels(robot: Robot, seconds: float) -> tuple[list[Channel], list[Channel], list[Channel]]:
    """Positions, velocities and efforts of a robot's joints, of so long a recording [s]."""
    motors = {a.joint: a for a in robot.actuators}
    length = lengths(robot)
    force = {'m': 'N', 'rad': 'N m'}
    names = robot.joint_names
    speed = {n: _free_speed(motors[n]) if n in motors else FAST for n in names}
    torque = {name: _stall(motor) for name, motor in motors.items()}
    return (
        [Channel(f'positions of {n}', length[n], max(seconds, 1.0) * speed[n]) for n in names],
        [Channel(f'velocities of {n}', f'{length[n]}/s', speed[n]) for n in names],
        [Channel(f'efforts of {n}', force[length[n]], torque.get(n, ABSURD)) for n in names],
    )


def _free_speed(motor: Actuator) -> float:
    """Speed that its supply gives a motor without load [rad/s], not less than `FAST`."""
    if motor.supply is None or not motor.torque_constant:
        return FAST
    return max(FAST, motor.supply / motor.torque_constant)


def _stall(motor: Actuator) -> float:
    """Largest torque [N m]: of a motor on a voltage that of its supply at rest."""
    if motor.supply is None or motor.torque_constant is None or not motor.resistance:
        return motor.limit
    return motor.torque_constant * motor.supply / motor.resistance
