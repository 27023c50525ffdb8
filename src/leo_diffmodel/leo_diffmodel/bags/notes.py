# SPDX-License-Identifier: Apache-2.0
"""What a user should know about a bag that was read, one line each."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.bag_contents import TopicLog
from leo_sim.drivers.base import INTERFACES

from .finish import is_recording
from .inputs import InputLog
from .passive import named, unread_commands
from .split import Segments
from .states import deserialize, StateLog
from .topic_map import DEFAULT_NAMES, RobotBag
from .types import APPLIED, CONTROLLER_STATE, DYNAMIC_JOINT_STATE, JOINT_STATE
from .unmeasured import DIFFERENTIATED, NO_INPUT

_MANY_UNUSED = 0.02
_SHOWN = 3


def notes_of(
    bag: RobotBag, states: StateLog, segments: Segments, inputs: InputLog | None, used: int
) -> tuple[str, ...]:
    """Return a line for all that was left out, mended or passed over; of `used` states."""
    found = [*_of_states(bag, states, segments, used), *_of_inputs(bag, states, inputs)]
    return tuple(f'{bag.path}: {text}' for text in found)


def _of_states(bag: RobotBag, states: StateLog, segments: Segments, used: int) -> list[str]:
    contents, unused = bag.contents, len(states.q) - used
    broken = sum(topic.broken for topic in contents.topics.values())
    lost = contents.metadata.get('leo', {}).get('lost')
    said = any(DIFFERENTIATED in text for text in states.notes)
    gaps, jumps = segments.breaks.get('gap', 0), segments.breaks.get('jump', 0)
    recorded = any(map(is_recording, contents.files))
    cut = 'cut short (the recorder was killed?); read up to the cut'
    found = [
        (not contents.finished, 'still being recorded; read up to now' if recorded else cut),
        (contents.damaged, f'damaged in {contents.damaged} places; what is there was left out'),
        (lost, f'{lost} messages were lost while it was recorded'),
        (broken, f'{broken} messages could not be decoded; left out'),
        (states.dropped, f'{states.dropped} samples with NaN left out'),
        *((True, text) for text in states.notes),
        (not states.stamped, 'joint states carry no stamps; log times taken instead'),
        (states.rates == 'absent' and not said, f'no velocities; {DIFFERENTIATED}'),
        (len(segments.set_back), _set_back(states, segments.set_back)),
        (gaps, f'{gaps} gaps; split there'),
        (jumps, f'{jumps} jumps no model can make; split there'),
        (
            unused > _MANY_UNUSED * len(states.q),
            f'{unused} samples unused (lone, or before the first input)',
        ),
    ]
    return [text for holds, text in found if holds]


def _set_back(states: StateLog, back: NDArray[np.int64]) -> str:
    steps, since = np.diff(states.stamp_ns) * 1e-9, (states.stamp_ns - states.stamp_ns[0]) * 1e-9
    first = ', '.join(f'at {since[k]:.2f} s by {-steps[k]:.3g} s' for k in back[:_SHOWN])
    more = f' and {len(back) - _SHOWN} times more' if len(back) > _SHOWN else ''
    return f'the stamps of the joint states go back, {first}{more}: was a clock set? split there'


def _of_inputs(bag: RobotBag, states: StateLog, inputs: InputLog | None) -> list[str]:
    robot, notes = bag.robot, []
    if inputs is None and robot.actuators and any(NO_INPUT in text for text in states.notes):
        notes.append('no input is left, so the bag counts as passive, its motors free')
    strange = sorted(set(bag.map.joints) - set(robot.joint_names))
    if strange:
        notes.append(
            f'the topic map names {", ".join(strange)}, which {robot.name} lacks; it has '
            f'{", ".join(robot.joint_names)}'
        )
    if inputs is not None and inputs.dropped:
        notes.append(f'{inputs.dropped} inputs with NaN or of a wrong length left out')
    if inputs is not None:
        notes += inputs.notes
    if bag.map.input == 'auto':
        applied = _applied_topics(bag)
        notes += _passed_over(bag, applied, inputs)
        notes += _unread(bag, applied, inputs)
    return notes


def _passed_over(bag: RobotBag, applied: list[TopicLog], inputs: InputLog | None) -> Iterator[str]:
    source = inputs.source if inputs else 'none, so the bag counts as passive'
    if any(topic.name == source and topic.type == JOINT_STATE for topic in applied):
        return
    wanted = bag.map.interface or INTERFACES[bag.robot.input]
    for topic in applied:
        if topic.name != source:
            yield (
                f'{topic.name} has no usable {wanted} of {", ".join(bag.motors)} (there is '
                f'{_there(topic)}); inputs taken from: {source}'
            )


def _unread(bag: RobotBag, applied: list[TopicLog], inputs: InputLog | None) -> Iterator[str]:
    if inputs is None or inputs.source in {topic.name for topic in applied}:
        return
    source = bag.contents.topics.get(inputs.source.split(', ')[0])
    if source is not None and source.type == CONTROLLER_STATE:
        return  # which says what became of them
    if unread := unread_commands(bag, inputs.source):
        yield f'{named(unread)}; inputs taken from: {inputs.source}'


def _applied_topics(bag: RobotBag) -> list[TopicLog]:
    names = (*(topic.name for topic in APPLIED.values()), DEFAULT_NAMES['dynamic_joint_states'])
    mapped = [bag.map.topics.get('applied'), bag.map.topics.get('dynamic_joint_states')]
    return [
        topic
        for topic in bag.contents.topics.values()
        if topic.messages
        and topic.type in (JOINT_STATE, DYNAMIC_JOINT_STATE)
        and (topic.name in mapped or topic.name.endswith(names))
    ]


def _there(topic: TopicLog) -> str:
    message = next((m for _, m in deserialize(topic, topic.type)), None)
    joints = getattr(message, 'name', getattr(message, 'joint_names', []))
    if topic.type == JOINT_STATE:
        return ', '.join(joints) or 'nothing'
    pairs = zip(joints, getattr(message, 'interface_values', []), strict=False)
    return '; '.join(f'{n}: {", ".join(v.interface_names)}' for n, v in pairs) or 'nothing'
