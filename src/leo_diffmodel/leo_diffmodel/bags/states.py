# SPDX-License-Identifier: Apache-2.0
"""Joint states of a bag as arrays, in the robot's joint order and signs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.serde import SerdeError

from leo_msgs_py.cdr import decode
from leo_msgs_py.errors import UserError

from .contents import Logged, TopicLog
from .topic_map import JointMap, TopicMap
from .types import JOINT_STATE

Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]


class OtherJoints(UserError):
    """States of another robot."""


@dataclass(frozen=True)
class StateLog:
    """Joint states in log order; angles in rad (m), rates in rad/s (m/s), torques in N m.

    Attributes:
        log_ns: when recorded, shape (T,).
        published_ns: when published by the publisher's clock, shape (T,).
        stamp_ns: when measured, shape (T,); repeats of a state are gone.
        q, dq, effort: shape (T, J); dq or effort is None where the bag has none.
        dropped: samples left out for a NaN.
        stamped: whether the headers had stamps (else stamp_ns is log_ns).
    """

    log_ns: Stamps
    published_ns: Stamps
    stamp_ns: Stamps
    q: Floats
    dq: Floats | None
    effort: Floats | None
    dropped: int
    stamped: bool


def read_states(topic: TopicLog, joints: Sequence[str], topic_map: TopicMap) -> StateLog:
    """Decode the joint states of a topic.

    Raises:
        UserError: empty, joints missing (listing those there are), or nothing but NaN.
    """
    rows = list(_rows(topic, joints, topic_map))
    if not rows:
        raise UserError(f'no readable messages on {topic.name}; was the robot running?')
    logged = [row[0] for row in rows]
    log = np.array([message.log_ns for message in logged], dtype=np.int64)
    published = np.array([message.published_ns for message in logged], dtype=np.int64)
    stamp = np.array([row[1] for row in rows], dtype=np.int64)
    columns = [_column([row[k] for row in rows], len(joints)) for k in (2, 3, 4)]
    if columns[0] is None:
        raise UserError(f'the messages on {topic.name} have no positions')
    q, dq, effort = _ours(columns, [topic_map.joint(name) for name in joints])
    stamped = bool(stamp.any())
    stamp = stamp if stamped else log
    return _clean(topic, log, published, stamp, q, dq, effort, stamped)


def deserialize(topic: TopicLog, type_name: str) -> Iterator[tuple[Logged, Any]]:
    """Yield (logged, message) of a topic; what cannot be decoded is counted and left out.

    Args:
        topic: with the messages; its `broken` is set.
        type_name: their type.
    """
    topic.broken = 0
    for message in topic.messages:
        try:
            decoded = decode(message.data, type_name)
        except SerdeError:
            topic.broken += 1
        else:
            yield message, decoded


def stamp_of(message: Any) -> int:
    """Return the header stamp of a message in ns."""
    stamp = message.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _rows(
    topic: TopicLog, joints: Sequence[str], topic_map: TopicMap,
) -> Iterator[tuple[Any, ...]]:
    """Yield (logged, stamp, position, velocity, effort) of messages that have all joints."""
    wanted = [topic_map.joint(name).name for name in joints]
    orders: dict[tuple[str, ...], list[int] | None] = {}
    for logged, message in deserialize(topic, JOINT_STATE):
        names = tuple(message.name)
        if names not in orders:
            complete = set(wanted) <= set(names)
            orders[names] = [names.index(str(name)) for name in wanted] if complete else None
        order = orders[names]
        if order is not None:
            fields = (message.position, message.velocity, message.effort)
            picked = [f[order] if len(f) == len(names) else None for f in fields]
            yield logged, stamp_of(message), *picked
    if orders and not any(orders.values()):
        there = sorted({name for names in orders for name in names})
        raise OtherJoints(
            f'joints {", ".join(str(w) for w in wanted if w not in there)} are not on '
            f'{topic.name}; there are {", ".join(there) or "none"}. Rename in a topic map '
            '(joints: {ours: {name: theirs}})'
        )


def _ours(
    columns: Sequence[Floats | None], maps: Sequence[JointMap],
) -> tuple[Floats, Floats | None, Floats | None]:
    """Return angles, speeds and efforts in our units, signs and zeros."""
    q, dq, effort = columns
    sign, scale, offset, fast, zero = (
        np.array([float(getattr(m, name)) for m in maps])
        for name in ('sign', 'scale', 'offset', 'speed_scale', 'speed_zero')
    )
    return (
        sign * scale * np.asarray(q) + offset,
        None if dq is None else sign * fast * (dq - zero),
        None if effort is None else sign * effort,
    )


def _column(values: list[Floats | None], width: int) -> Floats | None:
    """Stack one field; samples without it become NaN, None where no sample has it."""
    if all(value is None for value in values):
        return None
    missing = np.full(width, np.nan)
    return np.array([missing if value is None else value for value in values], dtype=float)


def _never_filled(q: Floats, dq: Floats) -> bool:
    """Say whether velocities are NaN throughout, or zero although the joints move."""
    return bool(np.isnan(dq).all() or (not dq.any() and len(np.unique(q, axis=0)) > 2))


def _clean(
    topic: TopicLog, log: Stamps, published: Stamps, stamp: Stamps, q: Floats,
    dq: Floats | None, effort: Floats | None, stamped: bool,
) -> StateLog:
    """Drop repeats of a state (stamp and values) and samples with NaN."""
    dq = None if dq is None or _never_filled(q, dq) else dq
    moved = (q[1:] != q[:-1]).any(axis=1)
    fresh = np.concatenate([[True], (np.diff(stamp) != 0) | moved])
    whole = np.isfinite(q).all(axis=1)
    if dq is not None:
        whole &= np.isfinite(dq).all(axis=1)
    keep = fresh & whole
    if not keep.any():
        raise UserError(f'every sample on {topic.name} has a NaN; nothing usable is left')
    dq = None if dq is None else dq[keep]
    effort = None if effort is None else effort[keep]
    dropped = int(np.sum(fresh & ~whole))
    return StateLog(
        log[keep], published[keep], stamp[keep], q[keep], dq, effort, dropped, stamped
    )
