# SPDX-License-Identifier: Apache-2.0
"""Goals of all motors of a robot, from trajectories or from what their controllers follow."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from leo_msgs_py.errors import UserError

from .contents import BagContents, TopicLog
from .goal_path import Leg, sampled
from .goal_topics import Asked, asked, goal_topics
from .states import Floats, Stamps, StateLog
from .topic_map import Role, TopicMap


class Goals(NamedTuple):
    """Goals at the times of the states and where they turn, each held to the next.

    Attributes:
        source: topics they come from.
        log, stamp: [ns], shape (N,), in log order.
        values: in their joints' signs and zeros [rad, m], shape (N, A).
    """

    source: str
    log: Stamps
    stamp: Stamps
    values: Floats


def read_goals(
    contents: BagContents,
    role: Role,
    states: StateLog,
    names: Sequence[str],
    measured: Floats,
    topic_map: TopicMap,
) -> Goals | None:
    """Read the goals of joints, each from the topic that names it; None where none does.

    Args:
        contents: the bag.
        role: `trajectory` or `controller_state`.
        states: of the robot, T of them.
        names: the joints with a motor, as the bag calls them, A of them.
        measured: their angles, in their signs and zeros, shape (T, A).
        topic_map: may name the topic.

    Raises:
        UserError: a joint has no goal, or two topics' trajectories.
    """
    found = {t.name: said for t in goal_topics(contents, role, topic_map) if (said := asked(t))}
    if not any(name in a.names for said in found.values() for a in said for name in names):
        return None
    sources = [_source(contents, found, name, role) for name in names]
    parts = [
        _run(states, run, [found[s] for s in sources], names, measured, role)
        for run in _runs(states)
    ]
    log, stamp, values = (np.concatenate([part[k] for part in parts]) for k in range(3))
    if not len(log):
        return None
    return Goals(', '.join(dict.fromkeys(sources)), log, stamp, values)


def _source(contents: BagContents, found: dict[str, list[Asked]], name: str, role: Role) -> str:
    """The topic with the goals of a joint."""
    topics = [topic for topic, said in found.items() if any(name in a.names for a in said)]
    if not topics:
        raise UserError(
            f'{contents.path} has goals on {", ".join(found)}, and none for {name}; '
            'give a model without that motor, or record its goals'
        )
    if len(topics) > 1 and role == 'trajectory':
        raise UserError(
            f'{contents.path} has trajectories of {name} on {" and ".join(topics)}; '
            f'choose one in a topic map (topics: {{{role}: ...}})'
        )
    return topics[0]  # of a controller's state, which some publish twice, either


def _runs(states: StateLog) -> list[slice]:
    """Stretches of states whose stamps go forward: a restarted robot begins another."""
    cuts = np.flatnonzero(np.diff(states.stamp_ns) < 0) + 1
    edges = [0, *cuts.tolist(), len(states.stamp_ns)]
    return [slice(a, b) for a, b in pairwise(edges)]


def _run(
    states: StateLog,
    run: slice,
    said: list[list[Asked]],
    names: Sequence[str],
    measured: Floats,
    role: Role,
) -> tuple[Stamps, Stamps, Floats]:
    """Log times, stamps and goals of one run; none before all joints have one."""
    t = states.stamp_ns[run]
    first = states.log_ns[run.start] if run.start else np.iinfo(np.int64).min
    last = states.log_ns[run.stop] if run.stop < len(states.log_ns) else np.iinfo(np.int64).max
    now = [
        [a for a in of if first <= a.log_ns < last and name in a.names]
        for of, name in zip(said, names, strict=True)
    ]
    delay = int(np.median(states.log_ns[run] - t))
    legs = [
        _legs(of, name, delay, states.stamped, role) for of, name in zip(now, names, strict=True)
    ]
    if not all(legs):
        return t[:0], t[:0], np.zeros((0, len(names)))
    turns = [np.r_[leg.begin, leg.times] for of in legs for leg in of]
    inside = np.concatenate([t, *turns])
    begin = max(of[0].begin for of in legs)
    stamps = np.unique(inside[(inside >= max(begin, t[0])) & (inside <= t[-1])])
    starts = (
        float(np.interp(of[0].begin - t[0], t - t[0], measured[run, a]))
        for a, of in enumerate(legs)
    )
    values = [sampled(of, stamps, start) for of, start in zip(legs, starts, strict=True)]
    return stamps + delay, stamps, np.column_stack(values)


def _legs(said: list[Asked], name: str, delay: int, stamped: bool, role: Role) -> list[Leg]:
    """What the messages ask of one joint, in robot time, in the order in which it counts.

    Args:
        said: the messages that name it.
        name: of the joint.
        delay: from a stamp to when it is recorded [ns].
        stamped: whether the states have stamps, so that those of the messages count.
        role: `trajectory` or `controller_state`.
    """
    legs = []
    for a in said:
        came = a.log_ns - delay
        start = a.stamp_ns if a.stamp_ns and stamped else came
        begin = start if role == 'controller_state' else max(start, came)
        legs.append(Leg(begin, start + a.after_ns, a.goals[:, a.names.index(name)]))
    legs.sort(key=lambda leg: leg.begin)
    return [_followed(legs)] if role == 'controller_state' and legs else legs


def _followed(legs: list[Leg]) -> Leg:
    """Set points that a controller says it follows, as one path: straight from one to the next."""
    times, index = np.unique([leg.begin for leg in legs], return_index=True)
    return Leg(int(times[0]), times, np.array([legs[k].goals[0] for k in index]))


def names_joints(topic: TopicLog, names: Sequence[str]) -> bool:
    """Say whether a topic of trajectories or controller states has goals of any of the joints."""
    return any(set(a.names) & set(names) for a in asked(topic))
