# SPDX-License-Identifier: Apache-2.0
"""A bag as compare, explain and the difference model want it: episodes of states and inputs."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from leo_msgs_py.bag_contents import BagContents, load, TopicLog
from leo_msgs_py.errors import UserError
from leo_msgs_py.mcap_file import sha256
from leo_sim.description.robot import load_robot, Robot

from .episode import Episode as Episode
from .episode import Recording as Recording
from .episode import Recordings as Recordings
from .held import average, Held, held_inputs
from .impossible import without_impossible
from .inputs import InputLog, on_the_angles_turn, read_inputs
from .mend import on_time
from .notes import notes_of
from .spikes import without_spikes
from .split import split, unwrapped
from .states import median_step, read_states, StateLog
from .topic_map import COMMANDS, list_topics, read_topic_map, RobotBag, TopicMap
from .types import Floats, Stamps
from .unmeasured import without_made_rates, without_unmeasured

SELDOM = 10.0  # s from state to state: no motion of a robot shows in fewer
FILTERS = (without_impossible, without_unmeasured, without_made_rates, without_spikes, unwrapped)
"""What states go through between the bag and the episodes; each adds its notes."""


def read_bag(
    path: str | Path, robot: Robot | str | Path, topic_map: str | Path | TopicMap | None = None
) -> Recording:
    """Read any robot's rosbag2 bag, MCAP or SQLite, finished or not, at any and uneven rates.

    Args:
        path: a rosbag2 folder, or one .mcap or .db3 file.
        robot: the robot whose joints and actuators are wanted, its name or its folder.
        topic_map: a YAML file for other names, signs and timing (see `topic_map`).

    Raises:
        UserError: no such bag, topic or joint (listing those there are), or nothing usable.
    """
    wanted = load_robot(robot) if isinstance(robot, str | Path) else robot
    return assembled(load(Path(path)), wanted, read_topic_map(topic_map))


def read_both_ways(
    path: str | Path, robot: Robot, topic_map: TopicMap
) -> tuple[Recording, Recording | None]:
    """A bag as `read_bag` reads it, and with its inputs held the other way (or None)."""
    other = 'next' if topic_map.hold == 'previous' else 'previous'
    ways = held_each_way(load(Path(path)), robot, topic_map, (topic_map.hold, other))
    recording = next(ways)
    with suppress(UserError):
        return recording, next(ways)
    return recording, None


def assembled(contents: BagContents, robot: Robot, mapping: TopicMap) -> Recording:
    """The episodes of what a bag holds, or of messages that are not in one yet, as `read_bag`."""
    return next(held_each_way(contents, robot, mapping, (mapping.hold,)))


def held_each_way(
    contents: BagContents, robot: Robot, mapping: TopicMap, holds: Sequence[str]
) -> Iterator[Recording]:
    """Decode once; yield the recording, as `read_bag`, with its inputs held in each way."""
    bag = RobotBag(contents, robot, mapping)
    states = _states(bag)
    segments = split(states, bag.topic('episode'))
    inputs = on_the_angles_turn(read_inputs(bag, states), states, robot)
    digest, facts = sha256(contents.files), contents.metadata.get('leo', {})
    if mapping.held is not None:
        facts = {**facts, 'held': str(mapping.held).lower()}
    for hold in holds:
        held = held_inputs(states, inputs, segments.slices, hold == 'previous')
        episodes = _episodes(bag, states, segments.slices, held)
        used = sum(len(episode.t) for episode in episodes)
        recording = Recording(
            path=bag.path,
            sha256=digest,
            joints=tuple(robot.joint_names),
            actuators=tuple(a.joint for a in robot.actuators),
            input=inputs.kind if inputs else 'none',
            command_period=_command_period(bag, states, inputs),
            episodes=episodes,
            metadata=facts,
            warnings=notes_of(bag, states, segments, inputs, used),
            rates=states.rates,
        )
        yield on_time(recording, mapping)


def _states(bag: RobotBag) -> StateLog:
    contents = bag.contents
    if not contents.message_count:
        empty = contents.finished or not any(file.stat().st_size for file in contents.files)
        cut = 'is damaged, or was cut before the first message: nothing in it reads; record again'
        never = 'is empty: nothing was recorded; was the robot running?'
        raise UserError(f'{bag.path} {never if empty else cut}')
    topic = bag.topic('joint_states')
    if topic is None:
        raise UserError(
            f'{bag.path} has no topic /joint_states; it has {list_topics(contents)}. '
            'Name the one to use in a topic map (topics: {joint_states: ...})'
        )
    try:
        states = read_states(topic, bag.robot.joint_names, bag.map)
        for filtered in FILTERS:
            states = filtered(states, bag.robot, bag.map)
    except UserError as error:
        raise type(error)(f'{bag.path}: {error}') from error
    if (step := median_step(states.stamp_ns)) > SELDOM:
        raise UserError(
            f'{bag.path}: states come {step:.4g} s apart, and beyond {SELDOM:g} s no '
            'motion of a robot shows; which unit is its time in?'
        )
    return states


def _episodes(
    bag: RobotBag, states: StateLog, parts: Sequence[slice], held: Sequence[Held | None]
) -> tuple[Episode, ...]:
    actuators, time_scale = len(bag.robot.actuators), bag.map.time_scale
    both = zip(parts, held, strict=True)
    found = (_episode(states, part, own, actuators, time_scale) for part, own in both)
    episodes = tuple(episode for episode in found if episode is not None)
    if not episodes:
        raise UserError(f'{bag.path}: no joint states while inputs were recorded; record both')
    return episodes


def _episode(
    states: StateLog, part: slice, held: Held | None, actuators: int, time_scale: float
) -> Episode | None:
    if held is not None:
        first = held[0][0] if len(held[0]) else np.iinfo(np.int64).max
        part = slice(part.start + int((states.stamp_ns[part] < first).sum()), part.stop)
    if part.stop - part.start < 2:
        return None
    t, q = states.stamp_ns[part], states.q[part]
    inputs, enabled = np.zeros((len(t), actuators)), np.zeros((len(t), actuators), dtype=bool)
    if held is not None:
        stamps, values, on = held
        inputs, enabled = average(t, stamps, values), average(t, stamps, on) > 0.5
    return Episode(
        t=(t - states.stamp_ns[0]) * 1e-9,
        q=q,
        dq=_rates(t, q, None if states.dq is None else states.dq[part], time_scale),
        inputs=inputs,
        enabled=enabled,
        effort=None if states.effort is None else states.effort[part],
    )


def _rates(t: Stamps, q: Floats, dq: Floats | None, time_scale: float) -> Floats:
    """Measured rates (T, J); those that nobody measured (NaN) differentiated from the angles."""
    if dq is not None and not np.isnan(dq).any():
        return dq
    slope = np.gradient(q, (t - t[0]) * 1e-9, axis=0) / time_scale
    return slope if dq is None else np.where(np.isnan(dq), slope, dq)


def _command_period(bag: RobotBag, states: StateLog, inputs: InputLog | None) -> float:
    """The control period [s]: that of the robot for bags its recorder made.

    For foreign bags the median distance of the commands in robot time (whole state periods), else
    of the inputs, else of the states.
    """
    metadata = bag.contents.metadata.get('leo', {})
    if 'robot' in metadata and 'imported_from' not in metadata:
        return float(bag.robot.control_period)
    topic = bag.topic('commands', COMMANDS[bag.robot.input])
    state_period = median_step(states.stamp_ns)
    if topic is not None and len(topic.messages) > 2:
        return max(round(_commanded(topic, states) / state_period), 1) * state_period
    return state_period if inputs is None else median_step(inputs.stamp_ns) or state_period


def _commanded(topic: TopicLog, states: StateLog) -> float:
    logged = np.array([message.log_ns for message in topic.messages], dtype=np.int64)
    start = states.log_ns[0]
    stamps = states.stamp_ns - states.stamp_ns[0]
    t = np.interp(logged - start, states.log_ns - start, stamps)
    inside = t[(logged >= start) & (logged <= states.log_ns[-1])]
    return float(np.median(np.diff(inside))) * 1e-9 if len(inside) > 1 else 0.0
