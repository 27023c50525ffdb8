# SPDX-License-Identifier: Apache-2.0
"""Values that no robot has: of a flipped bit, a forged message, a number that is another's.

What is a hundred times beyond what its channel mostly says, and far beyond what the robot can do,
is left out. A whole channel in another unit stays, for `leo check` to say so.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError
from leo_sim.description.constants import INPUT_UNITS
from leo_sim.description.joint import sliding
from leo_sim.description.robot import Robot

from .states import StateLog
from .topic_map import TopicMap
from .types import at_rows, Floats

BEYOND = 100.0  # times what a channel mostly says, or how fast a joint can be: blows are less
OVERDRIVEN = 10.0  # times what a motor can do: impacts and overloads are less
ABSURD = 1e9
"""rad, rad/s, V, N m (m, m/s, N): a wheel at 3000 rad/s turns so far in four days, and no unit
that angles, rates or inputs are logged in makes so much of them."""
FAST = 100.0  # rad/s, m/s: so fast a joint may be, whatever its motor
MOSTLY = 0.9


class Channel(NamedTuple):
    name: str
    unit: str
    most: float  # no robot has more


def without_impossible(states: StateLog, robot: Robot, _: TopicMap) -> StateLog:
    """Leave out states that no robot has, and efforts alone; refuse a log without others."""
    seconds = float(np.ptp(states.stamp_ns)) * 1e-9
    positions, velocities, efforts = _channels(robot, seconds)
    out, notes = impossible(states.q, positions)
    if states.dq is not None:
        fast, more = impossible(states.dq, velocities)
        out, notes = out | fast, notes + more
    if states.effort is not None:
        strong, more = impossible(states.effort, efforts)
        states = replace(states, effort=np.where(strong, np.nan, states.effort))
        notes = notes + more
    keep = np.asarray(~out.any(axis=1))
    if not keep.any():
        raise UserError(f'no joint state is left: {notes[0]}; which unit is it in?')
    return at_rows(states.noted(notes), keep)


def input_channels(robot: Robot, kind: str) -> list[Channel]:
    channels = []
    for motor in robot.actuators:
        most = {'position': ABSURD, 'voltage': motor.strongest, 'torque': motor.stall}[kind]
        slides, unit = motor.joint in robot.slides, INPUT_UNITS[kind]
        name = f'inputs of {motor.joint}'
        channels.append(Channel(name, sliding(unit) if slides else unit, OVERDRIVEN * most))
    return channels


def lengths(robot: Robot) -> dict[str, str]:
    """Unit of each joint's position, in the robot's order: rad, of a slide m."""
    return {name: 'm' if name in robot.slides else 'rad' for name in robot.joint_names}


def impossible(values: Floats, channels: Sequence[Channel]) -> tuple[NDArray[np.bool_], list[str]]:
    """Say which values (N, C) no robot has, and how many of which channel, in words."""
    size = np.nan_to_num(np.abs(values), posinf=0.0)
    usual = np.quantile(size, MOSTLY, axis=0, method='lower')
    bound = np.minimum(ABSURD, np.maximum([c.most for c in channels], BEYOND * usual))
    beyond = size > bound
    return beyond, [
        f'{count} {channel.name} beyond {most:.3g} {channel.unit}, which no robot has; left out'
        for channel, count, most in zip(channels, beyond.sum(axis=0), bound, strict=True)
        if count
    ]


def _channels(robot: Robot, seconds: float) -> tuple[list[Channel], list[Channel], list[Channel]]:
    unit, force = lengths(robot), {'m': 'N', 'rad': 'N m'}
    speed = dict.fromkeys(unit, BEYOND * FAST)
    for motor in robot.actuators:
        if motor.supply is not None and motor.torque_constant:  # without load
            speed[motor.joint] = BEYOND * max(FAST, motor.supply / motor.torque_constant)
    torque = dict.fromkeys(unit, ABSURD) | {a.joint: OVERDRIVEN * a.stall for a in robot.actuators}
    return (
        [Channel(f'positions of {n}', u, max(seconds, 1.0) * speed[n]) for n, u in unit.items()],
        [Channel(f'velocities of {n}', f'{u}/s', speed[n]) for n, u in unit.items()],
        [Channel(f'efforts of {n}', force[u], torque[n]) for n, u in unit.items()],
    )
