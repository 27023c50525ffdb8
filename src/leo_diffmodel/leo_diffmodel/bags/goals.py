# SPDX-License-Identifier: Apache-2.0
"""Position goals as others send them: trajectories, and what their controllers say they follow.

As ros2_controllers' joint_trajectory_controller goes: a trajectory starts at its stamp, or when
it comes if that is 0; it leads from where the goal was (at first: where the joint was) to its
first point, straight from point to point, and holds the last one. A new one replaces what is left
of the former. Points whose time is over when it comes are passed over. Where points have
velocities the controller draws a spline; straight lines are off from it by less than a point
from its neighbours.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise, zip_longest
import struct
from typing import Any, NamedTuple

import numpy as np
from rosbags.serde import SerdeError

from leo_msgs_py.bag_contents import TopicLog
from leo_msgs_py.cdr import FOLLOWED, typestore
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import nanoseconds

from .states import deserialize, stamp_of, StateLog
from .topic_map import RobotBag, Role
from .types import Floats, Stamps, TRAJECTORY, TYPES


class Asked(NamedTuple):
    log_ns: int  # when it was recorded
    stamp_ns: int  # from when on it counts by its header; 0: as soon as it comes
    names: tuple[str, ...]
    after_ns: Stamps  # when after that they are to be there, shape (K,), increasing
    goals: Floats  # [rad, m], shape (K, n)


def goal_topics(bag: RobotBag, role: Role) -> list[TopicLog]:
    if role in bag.map.topics:
        named = bag.topic(role)
        return [] if named is None else [named]
    found = (topic for topic in bag.contents.of_type(TYPES[role]) if topic.messages)
    return sorted(found, key=lambda topic: topic.name)


def names_joints(topic: TopicLog, names: Sequence[str]) -> bool:
    return any(set(a.names) & set(names) for a in _asked(topic))


def _asked(topic: TopicLog) -> list[Asked]:
    return list(_trajectories(topic) if topic.type == TRAJECTORY else _set_points(topic))


def _trajectories(topic: TopicLog) -> Iterator[Asked]:
    for logged, message in deserialize(topic, topic.type):
        names = tuple(message.joint_names)
        points = [p for p in message.points if names and len(p.positions) == len(names)]
        after = np.array([nanoseconds(p.time_from_start) for p in points], dtype=np.int64)
        goals = np.array([p.positions for p in points], dtype=float)
        if points and np.isfinite(goals).all() and (np.diff(after) > 0).all():
            yield Asked(logged.log_ns, stamp_of(message), names, after, goals)


def _set_points(topic: TopicLog) -> Iterator[Asked]:
    for logged, message in deserialize(topic, FOLLOWED, _begin_of):
        names, goal = tuple(message.joint_names), message.reference.positions
        if names and len(goal) == len(names) and np.isfinite(goal).all():
            now = np.zeros(1, dtype=np.int64)
            yield Asked(logged.log_ns, stamp_of(message), names, now, np.array([goal]))


def _begin_of(data: bytes, type_name: str) -> Any:
    kind = typestore().get_msgdef(type_name)
    if len(data) < 4 or data[:2] not in (b'\x00\x00', b'\x00\x01'):
        raise SerdeError('no CDR')
    read = kind.deserialize_cdr_le if data[1] else kind.deserialize_cdr_be
    try:
        return read(memoryview(data)[4:], 0, kind.cls, typestore())[0]
    except (struct.error, UnicodeDecodeError, ValueError) as error:
        raise SerdeError(str(error)) from None


class Leg(NamedTuple):
    begin: int  # from when on it counts [ns]
    times: Stamps  # when the joint is to be there [ns], shape (K,), increasing
    goals: Floats  # [rad, m], shape (K,)


def _sampled(legs: Sequence[Leg], stamps: Stamps, first: float) -> Floats:
    """The goal at increasing times [ns] (N,), NaN before the first leg; it starts at `first`."""
    out = np.full(len(stamps), np.nan)
    was = first
    for leg, after in zip_longest(legs, legs[1:]):
        inside = stamps >= leg.begin
        if after is not None:
            inside &= stamps < after.begin
        out[inside] = _along(leg, was, stamps[inside])
        if after is not None:
            was = float(_along(leg, was, np.array([after.begin]))[0])
    return out


def _along(leg: Leg, was: float, stamps: Stamps) -> Floats:
    ahead = leg.times > leg.begin
    at_once = was
    if not ahead.any() or (leg.times == leg.begin).any():  # a point of now, or the last of all
        at_once = leg.goals[~ahead][-1]
    times = np.concatenate([[leg.begin], leg.times[ahead]])
    goals = np.concatenate([[at_once], leg.goals[ahead]])
    return np.asarray(np.interp(stamps - leg.begin, times - leg.begin, goals))


def read_goals(
    bag: RobotBag, role: Role, states: StateLog, measured: Floats
) -> tuple[str, Stamps, Stamps, Floats] | None:
    """Read the goals of joints, each from the topic that names it; None where none does.

    `measured` are angles (T, A), goals (N, A) [rad, m], both in the bag's signs and zeros. Returns
    the topics; log times and stamps [ns] (N,), in log order; goals at the times of the states and
    where they turn, each held to the next. Refuses two topics' trajectories, and no goal.
    """
    found = {topic.name: said for topic in goal_topics(bag, role) if (said := _asked(topic))}
    named = {name for said in found.values() for a in said for name in a.names}
    if not named & set(bag.motors):
        return None
    sources = [_source(bag, found, name, role) for name in bag.motors]
    asked = [(name, found[source]) for name, source in zip(bag.motors, sources, strict=True)]
    edges = [0, *(np.flatnonzero(np.diff(states.stamp_ns) < 0) + 1).tolist(), len(states.stamp_ns)]
    runs = [slice(a, b) for a, b in pairwise(edges)]  # a restarted robot begins another
    parts = [_run(states, run, asked, measured, role) for run in runs]
    log, stamp, values = (np.concatenate([part[k] for part in parts]) for k in range(3))
    if not len(log):
        return None
    return ', '.join(dict.fromkeys(sources)), log, stamp, values


def _source(bag: RobotBag, found: dict[str, list[Asked]], name: str, role: Role) -> str:
    topics = [topic for topic, said in found.items() if any(name in a.names for a in said)]
    if not topics:
        raise UserError(
            f'{bag.path} has goals on {", ".join(found)}, and none for {name}; '
            'give a model without that motor, or record its goals'
        )
    if len(topics) > 1 and role == 'trajectory':
        raise UserError(
            f'{bag.path} has trajectories of {name} on {" and ".join(topics)}; '
            f'choose one in a topic map (topics: {{{role}: ...}})'
        )
    return topics[0]  # of a controller's state, which some publish twice, either


def _run(
    states: StateLog, run: slice, asked: list[tuple[str, list[Asked]]], angles: Floats, role: Role
) -> tuple[Stamps, Stamps, Floats]:
    t = states.stamp_ns[run]
    first = states.log_ns[run.start] if run.start else np.iinfo(np.int64).min
    last = states.log_ns[run.stop] if run.stop < len(states.log_ns) else np.iinfo(np.int64).max
    delay = int(np.median(states.log_ns[run] - t))
    legs = []
    for name, messages in asked:
        now = [a for a in messages if first <= a.log_ns < last and name in a.names]
        legs.append(_legs(now, name, delay, states.stamped, role))
    if not all(legs):
        return t[:0], t[:0], np.zeros((0, len(legs)))
    turns = [np.r_[leg.begin, leg.times] for of in legs for leg in of]
    inside = np.concatenate([t, *turns])
    begin = max(of[0].begin for of in legs)
    stamps = np.unique(inside[(inside >= max(begin, t[0])) & (inside <= t[-1])])
    starts = (
        float(np.interp(of[0].begin - t[0], t - t[0], angles[run, a])) for a, of in enumerate(legs)
    )
    values = [_sampled(of, stamps, start) for of, start in zip(legs, starts, strict=True)]
    return stamps + delay, stamps, np.column_stack(values)


def _legs(said: list[Asked], name: str, delay: int, stamped: bool, role: Role) -> list[Leg]:
    """What the messages ask of one joint, in robot time, in order; set points are one path.

    `delay` is from a stamp to when it is recorded [ns]; stamps count where the states have some.
    """
    legs = []
    for a in said:
        came = a.log_ns - delay
        start = a.stamp_ns if a.stamp_ns and stamped else came
        begin = start if role == 'controller_state' else max(start, came)
        legs.append(Leg(begin, start + a.after_ns, a.goals[:, a.names.index(name)]))
    legs.sort(key=lambda leg: leg.begin)
    if role == 'trajectory' or not legs:
        return legs
    times, index = np.unique([leg.begin for leg in legs], return_index=True)
    return [Leg(int(times[0]), times, np.array([legs[k].goals[0] for k in index]))]
