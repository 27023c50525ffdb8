# SPDX-License-Identifier: Apache-2.0
"""Inputs of a bag as arrays: what was applied, else what was commanded, else the effort."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
import math
from typing import Any, TYPE_CHECKING

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import field_of

from .contents import BagContents, TopicLog
from .goal_turns import on_the_angles_turn
from .goals import read_goals
from .impossible import impossible, input_channels
from .passive import joint_names, refuse_driven
from .states import deserialize, Floats, stamp_of, Stamps, StateLog
from .topic_map import COMMANDS, find_topic, INTERFACES, Role, TopicMap
from .types import APPLIED, FLOAT64_ARRAY

if TYPE_CHECKING:
    from leo_sim.description.robot import Robot

Row = tuple[list[float], list[float]]
"""Values and enabled of one message, in actuator order."""
Reader = Callable[['BagContents', 'StateLog', 'Robot', 'TopicMap'], 'InputLog | None']
"""Reads one kind of input; None where the bag has none of it."""


@dataclass(frozen=True)
class InputLog:
    """Inputs in log order, row i acting from its stamp to the next.

    Attributes:
        kind: `voltage` [V], `torque` [N m] or `position` [rad].
        source: topic they come from.
        log_ns, stamp_ns: shape (N,).
        values, enabled: shape (N, A) in actuator order; enabled 1 or 0.
        dropped: messages left out for a NaN or a wrong length.
        told: which values no robot has, and are left out; which goals were wrapped; a line each.
    """

    kind: str
    source: str
    log_ns: Stamps
    stamp_ns: Stamps
    values: Floats
    enabled: Floats
    dropped: int
    told: tuple[str, ...] = ()


def read_inputs(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap
) -> InputLog | None:
    """Return the best inputs a bag has, None for a passive one.

    Raises:
        UserError: the topic map asks for inputs that are not there, or the robot was driven by
            goals that its model cannot take, or by what looks like a command and is not read.
    """
    readers: dict[str, Reader] = {
        'applied': _applied,
        'dynamic_joint_states': _dynamic,
        'commands': _commanded,
        'controller_state': partial(_asked, role='controller_state'),
        'trajectory': partial(_asked, role='trajectory'),
        'effort': _effort,
    }
    wanted = topic_map.input
    for name, reader in readers.items():
        if wanted in ('auto', name):
            found = reader(contents, states, robot, topic_map)
            if found is not None:
                return _on_the_angles_turn(found, states, robot)
    if wanted in readers:
        raise UserError(f'{contents.path} has no input on {wanted}, which the topic map asks for')
    if wanted == 'auto':
        refuse_driven(contents, robot, topic_map)
    return None


def _applied(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap
) -> InputLog | None:
    default = APPLIED[INTERFACES[robot.input]].name
    topic = find_topic(contents, 'applied', topic_map, default)
    row = partial(_applied_row, field_of(INTERFACES[robot.input]))
    return None if topic is None else _stated(topic, row, states, robot, topic_map)


def _dynamic(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap
) -> InputLog | None:
    if robot.input == 'position' and topic_map.interface is None:
        return None  # the positions there are measured ones, no goals
    topic = find_topic(contents, 'dynamic_joint_states', topic_map)
    row = partial(_dynamic_row, topic_map.interface or INTERFACES[robot.input])
    return None if topic is None else _stated(topic, row, states, robot, topic_map)


def _stated(
    topic: TopicLog,
    row: Callable[[Any, Sequence[str]], Row | None],
    states: StateLog,
    robot: Robot,
    topic_map: TopicMap,
) -> InputLog | None:
    """Read a topic that says what was applied: the messages with all actuators."""
    wanted = [str(topic_map.joint(a.joint).name) for a in robot.actuators]
    rows = [
        (logged.log_ns, stamp_of(message), *found)
        for logged, message in deserialize(topic, topic.type)
        if (found := row(message, wanted)) is not None
    ]
    if not rows:
        return None
    log, stamp = (np.array([r[k] for r in rows], dtype=np.int64) for k in (0, 1))
    values, enabled = (np.array([r[k] for r in rows], dtype=float) for k in (2, 3))
    if not states.stamped or not stamp.any():
        stamp = _to_robot_time(log, states)
    values = _ours(values, robot, topic_map)
    return _usable(InputLog(robot.input, topic.name, log, stamp, values, enabled, 0), robot)


def _applied_row(field: str, message: Any, wanted: Sequence[str]) -> Row | None:
    """Return what a JointState has in a field: NaN is a free motor, a wrong length not known."""
    names = list(message.name)
    if not set(wanted) <= set(names):
        return None
    applied = getattr(message, field)
    if len(applied) != len(names):
        return [math.nan] * len(wanted), [1.0] * len(wanted)
    values = applied[[names.index(name) for name in wanted]]
    free = np.isnan(values)
    return np.where(free, 0.0, values).tolist(), (~free).tolist()


def _dynamic_row(interface: str, message: Any, wanted: Sequence[str]) -> Row | None:
    joints = dict(zip(message.joint_names, message.interface_values, strict=False))
    if not all(name in joints and interface in joints[name].interface_names for name in wanted):
        return None
    values = [_interface(joints[name], interface) for name in wanted]
    return values, [_interface(joints[name], 'enabled', 1.0) for name in wanted]


def _interface(values: Any, name: str, default: float = float('nan')) -> float:
    if name not in values.interface_names:
        return default
    index = values.interface_names.index(name)
    value = float(values.values[index]) if index < len(values.values) else default
    return default if math.isnan(value) else value


def _commanded(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap
) -> InputLog | None:
    topic = find_topic(contents, 'commands', topic_map, COMMANDS[robot.input])
    if topic is None:
        return None
    order = topic_map.command_order or [a.joint for a in robot.actuators]
    missing = [a.joint for a in robot.actuators if a.joint not in order]
    if missing:
        raise UserError(f'command_order in the topic map lacks {", ".join(missing)}')
    picks = [order.index(a.joint) for a in robot.actuators]
    rows = [(logged.log_ns, m.data) for logged, m in deserialize(topic, FLOAT64_ARRAY)]
    if not rows:
        return None
    fitting = [(log, data[picks]) for log, data in rows if len(data) == len(order)]
    if not fitting:
        raise UserError(
            f'the commands on {topic.name} have {len(rows[0][1])} values, {len(order)} are '
            'needed; name their joints in a topic map (command_order: [...])'
        )
    log = np.array([row[0] for row in fitting], dtype=np.int64)
    values = _ours(np.array([row[1] for row in fitting]), robot, topic_map)
    return _usable(
        InputLog(
            robot.input,
            topic.name,
            log,
            _to_robot_time(log, states),
            values,
            np.ones_like(values),
            len(rows) - len(fitting),
        ),
        robot,
    )


def _asked(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap, role: Role
) -> InputLog | None:
    """Read the goals of servos from trajectories or from what their controllers follow."""
    if robot.input != 'position' or not robot.actuators:
        return None
    zero, one = (_ours(np.full((1, len(robot.actuators)), x), robot, topic_map) for x in (0, 1))
    columns = [robot.joint_names.index(a.joint) for a in robot.actuators]
    measured = (states.q[:, columns] - zero) / (one - zero)
    names = joint_names(robot, topic_map)
    goals = read_goals(contents, role, states, names, measured, topic_map)
    if goals is None:
        return None
    values = _ours(goals.values, robot, topic_map)
    ones = np.ones_like(values)
    return _usable(
        InputLog('position', goals.source, goals.log, goals.stamp, values, ones, 0), robot
    )


def _on_the_angles_turn(inputs: InputLog, states: StateLog, robot: Robot) -> InputLog:
    """Bring goals that were wrapped apart from the angles to the turn these are in."""
    if inputs.kind != 'position':
        return inputs
    kinds = {joint.name: joint.kind for joint in robot.joints}
    joints = [a.joint for a in robot.actuators]
    start = states.log_ns[0]
    angles = np.column_stack(
        [
            np.interp(
                inputs.log_ns - start,
                states.log_ns - start,
                states.q[:, robot.joint_names.index(joint)],
            )
            for joint in joints
        ]
    )
    angles[:, [kinds[joint] == 'prismatic' for joint in joints]] = np.nan
    values, told = on_the_angles_turn(inputs.values, inputs.enabled > 0, angles, joints)
    return replace(inputs, values=values, told=(*inputs.told, *told)) if told else inputs


def _effort(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap
) -> InputLog | None:
    if states.effort is None or not robot.actuators:
        return None
    columns = [robot.joint_names.index(a.joint) for a in robot.actuators]
    values = states.effort[:, columns]
    if not np.isfinite(values).any():
        return None
    if none := [a.joint for k, a in enumerate(robot.actuators) if np.isnan(values[:, k]).all()]:
        raise UserError(
            f'{contents.path} has efforts of some motors and none of {", ".join(none)}; give a '
            'model without that motor, or say in a topic map input: effort if 0 N m is right'
        )
    ones = np.ones_like(values)
    return _usable(
        InputLog('torque', 'effort', states.log_ns, states.stamp_ns, values, ones, 0), robot
    )


def _ours(values: Floats, robot: Robot, topic_map: TopicMap) -> Floats:
    """V, N m or rad along each actuated joint of theirs, (N, A); goals count from our zero."""
    joints = [topic_map.joint(a.joint) for a in robot.actuators]
    factors = np.array([(j.input_sign or j.sign) * j.input_scale for j in joints])
    ours = values * topic_map.scale * factors
    if robot.input != 'position':
        return ours
    return ours + np.array([j.offset for j in joints])


def _to_robot_time(log: Stamps, states: StateLog) -> Stamps:
    """Map log times to the robot's clock by the median delay of the states."""
    delays = np.sort(states.log_ns - states.stamp_ns)
    return np.asarray(log - delays[len(delays) // 2])


def _usable(inputs: InputLog, robot: Robot) -> InputLog | None:
    """Drop messages with NaN or what no robot has; None where nothing is left."""
    finite = np.isfinite(inputs.values).all(axis=1)
    beyond, told = impossible(inputs.values, input_channels(robot, inputs.kind))
    keep = finite & ~beyond.any(axis=1)
    if not keep.any():
        return None
    return replace(
        inputs,
        log_ns=inputs.log_ns[keep],
        stamp_ns=inputs.stamp_ns[keep],
        values=inputs.values[keep],
        enabled=inputs.enabled[keep],
        dropped=inputs.dropped + int(np.sum(~finite)),
        told=tuple(told),
    )
