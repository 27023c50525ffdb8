# SPDX-License-Identifier: Apache-2.0
"""What a user should know about a bag that was read, one line each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from leo_sim.description.robot import Robot
from leo_sim.drivers.base import INTERFACES

from .contents import BagContents, TopicLog
from .finish import is_recording
from .inputs import InputLog
from .passive import joint_names, named, unread_commands
from .split import Segments
from .states import deserialize, StateLog
from .topic_map import DEFAULT_NAMES, TopicMap
from .types import APPLIED, CONTROLLER_STATE, DYNAMIC_JOINT_STATE, JOINT_STATE
from .unmeasured import DIFFERENTIATED, NO_INPUT

_MANY_UNUSED = 0.02
_SHOWN = 3


def reading_notes(
    contents: BagContents,
    states: StateLog,
    segments: Segments,
    turns: int,
    used: int,
    made: str,
    impossible: Sequence[str],
) -> list[str]:
    """Return what was left out, mended or split.

    Args:
        contents: the bag.
        states: as read.
        segments: where they were split.
        turns: wraps by whole turns that were undone.
        used: states that are in an episode.
        made: which differences of the positions the velocities were; '' for none.
        impossible: which values no robot has, or nobody measured.
    """
    unused = len(states.q) - used
    broken = sum(topic.broken for topic in contents.topics.values())
    lost = contents.metadata.get('leo', {}).get('lost')
    said = any(DIFFERENTIATED in text for text in impossible)
    gaps, jumps = segments.breaks.get('gap', 0), segments.breaks.get('jump', 0)
    found = [
        (not contents.finished, _unfinished(contents)),
        (contents.damaged, f'damaged in {contents.damaged} places; what is there was left out'),
        (lost, f'{lost} messages were lost while it was recorded, as the disk was full'),
        (broken, f'{broken} messages could not be decoded; left out'),
        (states.dropped, f'{states.dropped} samples with NaN left out'),
        *((True, text) for text in (*states.notes, *impossible)),
        (not states.stamped, 'joint states carry no stamps; log times taken instead'),
        (made, f'the velocities are {made} differences of the positions; differentiated anew'),
        (states.dq is None and not made and not said, f'no velocities; {DIFFERENTIATED}'),
        (turns, f'{turns} wraps by whole turns undone'),
        (len(segments.set_back), _set_back(states, segments.set_back)),
        (gaps, f'{gaps} gaps; split there'),
        (jumps, f'{jumps} jumps no model can make; split there'),
        (
            unused > _MANY_UNUSED * len(states.q),
            f'{unused} samples unused (lone, or before the first input)',
        ),
    ]
    return [f'{contents.path}: {text}' for holds, text in found if holds]


def _set_back(states: StateLog, back: NDArray[np.int64]) -> str:
    """When the clock of the joint states was set back, and by how much."""
    steps, since = np.diff(states.stamp_ns) * 1e-9, (states.stamp_ns - states.stamp_ns[0]) * 1e-9
    first = ', '.join(f'at {since[k]:.2f} s by {-steps[k]:.3g} s' for k in back[:_SHOWN])
    more = f' and {len(back) - _SHOWN} times more' if len(back) > _SHOWN else ''
    return f'the stamps of the joint states go back, {first}{more}: was a clock set? split there'


def input_notes(
    contents: BagContents,
    robot: Robot,
    topic_map: TopicMap,
    inputs: InputLog | None,
    unmeasured: Sequence[str],
) -> list[str]:
    """Return which joints of the map and inputs were unusable, and which were passed over."""
    notes = []
    if inputs is None and robot.actuators and any(NO_INPUT in text for text in unmeasured):
        notes.append('no input is left, so the bag counts as passive, its motors free')
    strange = sorted(set(topic_map.joints) - set(robot.joint_names))
    if strange:
        notes.append(
            f'the topic map names {", ".join(strange)}, which {robot.name} lacks; it has '
            f'{", ".join(robot.joint_names)}'
        )
    if inputs is not None and inputs.dropped:
        notes.append(f'{inputs.dropped} inputs with NaN or of a wrong length left out')
    if inputs is not None:
        notes += inputs.notes
    if topic_map.input == 'auto':
        notes += _passed_over(contents, robot, topic_map, inputs)
        notes += _unread(contents, robot, topic_map, inputs)
    return [f'{contents.path}: {note}' for note in notes]


def _passed_over(
    contents: BagContents, robot: Robot, topic_map: TopicMap, inputs: InputLog | None
) -> list[str]:
    """Return which topics say what was applied, but not what this robot needs."""
    source = inputs.source if inputs else 'none, so the bag counts as passive'
    applied = _applied_topics(contents, topic_map)
    if any(topic.name == source and topic.type == JOINT_STATE for topic in applied):
        return []
    wanted = topic_map.interface or INTERFACES[robot.input]
    joints = ', '.join(joint_names(robot, topic_map))
    return [
        f'{topic.name} has no usable {wanted} of {joints} (there is {_there(topic)}); inputs '
        f'taken from: {source}'
        for topic in applied
        if topic.name != source
    ]


def _unread(
    contents: BagContents, robot: Robot, topic_map: TopicMap, inputs: InputLog | None
) -> list[str]:
    """Return which topics look like commands, where no topic says what was applied."""
    applied = {topic.name for topic in _applied_topics(contents, topic_map)}
    if inputs is None or inputs.source in applied:
        return []
    source = contents.topics.get(inputs.source.split(', ')[0])
    if source is not None and source.type == CONTROLLER_STATE:
        return []  # which says what became of them
    unread = unread_commands(contents, robot, topic_map, inputs.source)
    return [f'{named(unread)}; inputs taken from: {inputs.source}'] if unread else []


def _applied_topics(contents: BagContents, topic_map: TopicMap) -> list[TopicLog]:
    names = (*(topic.name for topic in APPLIED.values()), DEFAULT_NAMES['dynamic_joint_states'])
    mapped = [topic_map.topics.get('applied'), topic_map.topics.get('dynamic_joint_states')]
    return [
        topic
        for topic in contents.topics.values()
        if topic.messages
        and topic.type in (JOINT_STATE, DYNAMIC_JOINT_STATE)
        and (topic.name in mapped or topic.name.endswith(names))
    ]


def _there(topic: TopicLog) -> str:
    """Return the joints of the first message, of a DynamicJointState with their interfaces."""
    message = next((m for _, m in deserialize(topic, topic.type)), None)
    joints = getattr(message, 'name', getattr(message, 'joint_names', []))
    if topic.type == JOINT_STATE:
        return ', '.join(joints) or 'nothing'
    pairs = zip(joints, getattr(message, 'interface_values', []), strict=False)
    return '; '.join(f'{n}: {", ".join(v.interface_names)}' for n, v in pairs) or 'nothing'


def _unfinished(contents: BagContents) -> str:
    if any(map(is_recording, contents.files)):
        return 'still being recorded; read up to now'
    return 'cut short (the recorder was killed?); read up to the cut'
