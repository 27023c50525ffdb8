# SPDX-License-Identifier: Apache-2.0
"""How long one command of a bag lasts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .contents import BagContents, TopicLog
from .inputs import InputLog
from .states import Stamps, StateLog
from .topic_map import COMMANDS, find_topic, TopicMap

if TYPE_CHECKING:
    from leo_sim.description.robot import Robot


def command_period(
    contents: BagContents,
    robot: Robot,
    topic_map: TopicMap,
    states: StateLog,
    inputs: InputLog | None,
) -> float:
    """Return the control period [s].

    That of the robot for bags its recorder made. For foreign bags the median distance of the
    commands in robot time (whole state periods), else of the inputs, else of the states.
    """
    metadata = contents.metadata.get('leo', {})
    if 'robot' in metadata and 'imported_from' not in metadata:
        return float(robot.control_period)
    topic = find_topic(contents, 'commands', topic_map, COMMANDS[robot.input])
    state_period = median_step(states.stamp_ns)
    if topic is not None and len(topic.messages) > 2:
        return max(round(_commanded(topic, states) / state_period), 1) * state_period
    return state_period if inputs is None else median_step(inputs.stamp_ns) or state_period


def _commanded(topic: TopicLog, states: StateLog) -> float:
    """Return the median distance of commands [s] in the time of the states around them."""
    logged = np.array([message.log_ns for message in topic.messages], dtype=np.int64)
    start = states.log_ns[0]
    stamps = states.stamp_ns - states.stamp_ns[0]
    t = np.interp(logged - start, states.log_ns - start, stamps)
    inside = t[(logged >= start) & (logged <= states.log_ns[-1])]
    return float(np.median(np.diff(inside))) * 1e-9 if len(inside) > 1 else 0.0


def median_step(stamps: Stamps) -> float:
    """Return the median of the forward steps [s], 0 without any."""
    steps = np.diff(stamps)
    forward = steps[steps > 0]
    return float(np.median(forward)) * 1e-9 if forward.size else 0.0
