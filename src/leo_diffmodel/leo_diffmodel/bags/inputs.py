# SPDX-License-Identifier: Apache-2.0
"""Inputs of a bag as arrays: what was applied, else what was commanded, else the effort."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any, TYPE_CHECKING

import numpy as np

from leo_msgs_py.errors import UserError

from .contents import BagContents, TopicLog
from .states import deserialize, Floats, stamp_of, Stamps, StateLog
from .topic_map import COMMANDS, find_topic, TopicMap
from .types import DYNAMIC_JOINT_STATE, FLOAT64_ARRAY

if TYPE_CHECKING:
    from leo_sim.robot import Robot

INTERFACES = {'voltage': 'voltage', 'torque': 'effort'}


@dataclass(frozen=True)
class InputLog:
    """Inputs in log order, row i acting from its stamp to the next.

    Attributes:
        kind: `voltage` [V] or `torque` [N m].
        source: topic they come from.
        log_ns, stamp_ns: shape (N,).
        values, enabled: shape (N, A) in actuator order; enabled 1 or 0.
        dropped: messages left out for a NaN or a wrong length.
    """

    kind: str
    source: str
    log_ns: Stamps
    stamp_ns: Stamps
    values: Floats
    enabled: Floats
    dropped: int


def read_inputs(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap,
) -> InputLog | None:
    """Return the best inputs a bag has, None for a passive one.

    Raises:
        UserError: the topic map asks for inputs that are not there.
    """
    readers = {
        'dynamic_joint_states': _applied, 'commands': _commanded, 'effort': _effort,
    }
    wanted = topic_map.input
    for name, reader in readers.items():
        if wanted in ('auto', name):
            found = reader(contents, states, robot, topic_map)
            if found is not None:
                return found
    if wanted in readers:
        raise UserError(f'{contents.path} has no input on {wanted}, which the topic map asks for')
    return None


def _applied(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap,
) -> InputLog | None:
    topic = find_topic(contents, 'dynamic_joint_states', topic_map)
    if topic is None:
        return None
    interface = topic_map.interface or INTERFACES[robot.input]
    rows = _interface_rows(topic, interface, [a.joint for a in robot.actuators], topic_map)
    if not rows:
        return None
    values = np.array([row[2] for row in rows]) * _signs(robot, topic_map)
    enabled = np.array([row[3] for row in rows])
    log, stamp = (np.array([row[k] for row in rows], dtype=np.int64) for k in (0, 1))
    if not states.stamped or not stamp.any():
        stamp = _to_robot_time(log, states)
    return _finite(InputLog(robot.input, topic.name, log, stamp, values, enabled, 0))


def _interface_rows(
    topic: TopicLog, interface: str, actuated: Sequence[str], topic_map: TopicMap,
) -> list[tuple[int, int, list[float], list[float]]]:
    """Return (log, stamp, values, enabled) of the messages with `interface` on all actuators."""
    wanted = [str(topic_map.joint(name).name) for name in actuated]
    rows = []
    for logged, message in deserialize(topic, DYNAMIC_JOINT_STATE):
        joints = dict(zip(message.joint_names, message.interface_values, strict=False))
        if all(name in joints and interface in joints[name].interface_names for name in wanted):
            values = [_interface(joints[name], interface) for name in wanted]
            enabled = [_interface(joints[name], 'enabled', 1.0) for name in wanted]
            rows.append((logged.log_ns, stamp_of(message), values, enabled))
    return rows


def _interface(values: Any, name: str, default: float = float('nan')) -> float:
    if name not in values.interface_names:
        return default
    index = values.interface_names.index(name)
    value = float(values.values[index]) if index < len(values.values) else default
    return default if math.isnan(value) else value


def _commanded(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap,
) -> InputLog | None:
    topic = find_topic(contents, 'commands', topic_map, COMMANDS[robot.input])
    if topic is None or not topic.messages:
        return None
    order = topic_map.command_order or [a.joint for a in robot.actuators]
    missing = [a.joint for a in robot.actuators if a.joint not in order]
    if missing:
        raise UserError(f'command_order in the topic map lacks {", ".join(missing)}')
    picks = [order.index(a.joint) for a in robot.actuators]
    rows = [(logged.log_ns, m.data) for logged, m in deserialize(topic, FLOAT64_ARRAY)]
    fitting = [(log, data[picks]) for log, data in rows if len(data) == len(order)]
    if not fitting:
        raise UserError(
            f'the commands on {topic.name} have {len(rows[0][1])} values, {len(order)} are '
            'needed; name their joints in a topic map (command_order: [...])'
        )
    log = np.array([row[0] for row in fitting], dtype=np.int64)
    values = np.array([row[1] for row in fitting]) * _signs(robot, topic_map)
    return _finite(InputLog(
        robot.input, topic.name, log, _to_robot_time(log, states), values,
        np.ones_like(values), len(rows) - len(fitting),
    ))


def _effort(
    contents: BagContents, states: StateLog, robot: Robot, topic_map: TopicMap,
) -> InputLog | None:
    if states.effort is None or not robot.actuators:
        return None
    columns = [robot.joint_names.index(a.joint) for a in robot.actuators]
    values = states.effort[:, columns]
    if not np.isfinite(values).any():
        return None
    ones = np.ones_like(values)
    return _finite(InputLog(
        'torque', 'effort', states.log_ns, states.stamp_ns, values, ones, 0,
    ))


def _signs(robot: Robot, topic_map: TopicMap) -> Floats:
    return np.array([float(topic_map.joint(a.joint).sign) for a in robot.actuators])


def _to_robot_time(log: Stamps, states: StateLog) -> Stamps:
    """Map log times to the robot's clock by the median delay of the states."""
    delays = np.sort(states.log_ns - states.stamp_ns)
    return np.asarray(log - delays[len(delays) // 2])


def _finite(inputs: InputLog) -> InputLog | None:
    """Drop messages with NaN; None where nothing is left."""
    keep = np.isfinite(inputs.values).all(axis=1)
    if not keep.any():
        return None
    return InputLog(
        inputs.kind, inputs.source, inputs.log_ns[keep], inputs.stamp_ns[keep],
        inputs.values[keep], inputs.enabled[keep], inputs.dropped + int(np.sum(~keep)),
    )
