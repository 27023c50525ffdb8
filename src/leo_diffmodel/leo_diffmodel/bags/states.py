# SPDX-License-Identifier: Apache-2.0
"""Joint states of a bag as arrays in a robot's joint order."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from rosbags.serde import SerdeError

from leo_msgs_py.bag_contents import Logged, TopicLog
from leo_msgs_py.cdr import decoder
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import nanoseconds
from leo_sim.description.robot import OtherRobot

from .publishers import Part, together
from .topic_map import JointMap, TopicMap
from .types import at_rows, Floats, JOINT_STATE, Stamps


@dataclass(frozen=True)
class StateLog:
    """Joint states in log order, none twice; NaN for rates or efforts that nobody measures."""

    log_ns: Stamps  # when recorded, shape (T,)
    published_ns: Stamps  # when published, by the publisher's clock, shape (T,)
    stamp_ns: Stamps  # when measured, shape (T,); log_ns if not `stamped`
    q: Floats  # [rad, m], shape (T, J)
    dq: Floats | None  # [rad/s, m/s], shape (T, J); None where the bag has none
    effort: Floats | None  # [N m], shape (T, J); None where the bag has none
    dropped: int  # samples left out for a NaN
    stamped: bool
    notes: tuple[str, ...] = ()  # of several publishers and of filters, one line each
    made: bool = False  # the rates were differences of the positions, and were left out

    @property
    def rates(self) -> str:
        if self.made:
            return 'made'
        return 'absent' if self.dq is None else 'measured'

    def noted(self, notes: Sequence[str], **changed: Any) -> 'StateLog':
        return replace(self, notes=(*self.notes, *notes), **changed)


def read_states(topic: TopicLog, joints: Sequence[str], topic_map: TopicMap) -> StateLog:
    """Decode the joint states of a topic; refuse it empty, without a joint or all NaN."""
    parts = _parts(topic, [topic_map.theirs(name) for name in joints], topic_map.frame_id)
    if not parts:
        of = '' if topic_map.frame_id is None else f' of frame_id {topic_map.frame_id!r}'
        raise UserError(f'no readable messages{of} on {topic.name}; was the robot running?')
    found = together(parts, joints, topic.name)
    if found is None:
        raise _other_joints(topic, joints, topic_map, parts)
    made, notes = found
    if made.fields[0] is None:
        raise UserError(f'the messages on {topic.name} have {_positions(topic)}')
    channels = in_our_units(made.fields, [topic_map.joint(name) for name in joints])
    stamped = bool(made.stamp.any())
    times = made.log, made.published, made.stamp if stamped else made.log
    return _clean(StateLog(*times, *channels, 0, stamped, notes), topic.name)


def deserialize(
    topic: TopicLog, type_name: str, decode: Callable[[bytes, str], Any] | None = None
) -> Iterator[tuple[Logged, Any]]:
    """Yield (logged, message) of a topic; what cannot be decoded is counted in its `broken`."""
    topic.broken, decode = 0, decode or decoder(type_name)
    for message in topic.messages:
        try:
            decoded = decode(message.data, type_name)
        except SerdeError:
            topic.broken += 1
        else:
            yield message, decoded


def stamp_of(message: Any) -> int:
    return nanoseconds(message.header.stamp)


def median_step(stamps: Stamps) -> float:
    steps = np.diff(stamps)
    forward = steps[steps > 0]
    return float(np.median(forward)) * 1e-9 if forward.size else 0.0


def in_our_units(
    columns: Sequence[Floats | None], maps: Sequence[JointMap]
) -> tuple[Floats, Floats | None, Floats | None]:
    q, dq, effort = columns
    if dq is not None:
        dq = np.stack([_signed(x, m) for x, m in zip(dq.T, maps, strict=True)], axis=1)
    sign, scale, offset, fast, zero = (
        np.array([float(getattr(m, name)) for m in maps])
        for name in ('sign', 'scale', 'offset', 'speed_scale', 'speed_zero')
    )
    return (
        sign * scale * np.asarray(q) + offset,
        None if dq is None else sign * fast * (dq - zero),
        None if effort is None else sign * effort,
    )


def _signed(speed: Floats, joint: JointMap) -> Floats:
    if joint.speed_wraps is not None:
        return np.where(speed > 0.5 * joint.speed_wraps, speed - joint.speed_wraps, speed)
    if joint.speed_sign_at is not None:
        at = joint.speed_sign_at
        return np.where(speed > 0.75 * at, at - speed, speed)
    return speed


def _parts(topic: TopicLog, wanted: Sequence[str], frame_id: str | None) -> list[Part]:
    sent: dict[tuple[str, tuple[str, ...]], list[tuple[Logged, Any]]] = defaultdict(list)
    for logged, message in deserialize(topic, JOINT_STATE):
        frame = message.header.frame_id
        if frame_id in (None, frame):
            sent[frame, tuple(message.name)].append((logged, message))
    return [_part(topic, *who, rows, wanted) for who, rows in sent.items()]


def _part(
    topic: TopicLog,
    frame: str,
    names: tuple[str, ...],
    rows: Sequence[tuple[Logged, Any]],
    wanted: Sequence[str],
) -> Part:
    if doubled := [name for name in wanted if names.count(name) > 1]:
        raise UserError(
            f'a message on {topic.name} names {", ".join(doubled)} twice, and nothing says which '
            'of its states is right; mend what publishes it, and record again'
        )
    ours = tuple(k for k, name in enumerate(wanted) if name in names)
    times = [(logged.log_ns, logged.published_ns, stamp_of(m)) for logged, m in rows]
    log, published, stamp = np.array(times, dtype=np.int64).T
    theirs = [names.index(wanted[k]) for k in ours]
    fields: list[Floats | None] = []
    for field in ('position', 'velocity', 'effort'):
        told = [getattr(message, field) for _, message in rows]
        whole = [k for k, values in enumerate(told) if len(values) == len(names)]
        if not (ours and whole):
            fields.append(None)
            continue
        found = np.full((len(rows), len(wanted)), np.nan)
        found[np.ix_(whole, ours)] = np.array([told[k] for k in whole])[:, theirs]
        fields.append(found)
    return Part(frame, names, ours, log, published, stamp, tuple(fields))


def _positions(topic: TopicLog) -> str:
    counts = [(len(m.position), len(m.name)) for _, m in deserialize(topic, JOINT_STATE)]
    positions, names = max(counts)
    if not positions:
        return 'no positions'
    return f'{positions} position(s) for {names} names of joints; each joint needs one'


def _other_joints(
    topic: TopicLog, joints: Sequence[str], topic_map: TopicMap, parts: Sequence[Part]
) -> OtherRobot:
    there = sorted({name for part in parts for name in part.names})
    wanted = [topic_map.theirs(name) for name in joints]
    return OtherRobot(
        f'joints {", ".join(w for w in wanted if w not in there)} are not on '
        f'{topic.name}; there are {", ".join(there) or "none"}. Rename in a topic map '
        '(joints: {ours: {name: theirs}})'
    )


def _clean(states: StateLog, topic: str) -> StateLog:
    q, dq = states.q, states.dq
    moved = (q[1:] != q[:-1]).any(axis=1)
    fresh = np.concatenate([[True], (np.diff(states.stamp_ns) != 0) | moved])
    whole = np.isfinite(q).all(axis=1)
    if dq is not None:
        some = ~np.isnan(dq).all(axis=0)  # of a joint whose rate nobody measures no sample has one
        whole &= np.isfinite(dq[:, some]).all(axis=1)
        dq = dq if some.any() else None
    keep = fresh & whole
    if not keep.any():
        raise UserError(f'every sample on {topic} has a NaN; nothing usable is left')
    return at_rows(replace(states, dq=dq, dropped=int(np.sum(fresh & ~whole))), keep)
