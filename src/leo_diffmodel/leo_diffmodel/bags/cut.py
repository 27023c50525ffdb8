# SPDX-License-Identifier: Apache-2.0
"""Parts of a bag in a new bag: all topics, stamps as they were."""

from collections.abc import Sequence
from dataclasses import replace
from operator import itemgetter
from pathlib import Path

import numpy as np

from leo_msgs_py.bag_contents import BagContents, load, Logged, TopicLog
from leo_msgs_py.errors import UserError

from .episode import check
from .finish import is_recording
from .topic_map import find_topic, list_topics, TopicMap
from .types import LATCHED, UINT32
from .writer import whole_bag


def cut_bag(
    path: Path,
    new: Path,
    begin: float | None = None,
    end: float | None = None,
    out: Sequence[tuple[float, float]] = (),
    topic_map: TopicMap | None = None,
) -> int:
    """Write what lies between `begin` and `end` and in none of the stretches `out`.

    Times count from when the first joint state was logged [s]. Of a latched topic, and of the
    episode number, the last message before the part is kept too, logged where the part begins.
    Returns how many messages were written.
    """
    low, high = check(begin, end)
    contents = load(path)
    if any(is_recording(file) for file in contents.files):
        raise UserError(f'{path} is still being recorded; stop its recorder first')
    states = find_topic(contents, 'joint_states', topic_map or TopicMap())
    if states is None or not states.messages:
        raise UserError(
            f'{path} has no joint states to count time from; it has {list_topics(contents)}'
        )
    zero = states.messages[0].log_ns
    topics = {
        name: replace(topic, messages=_chosen(topic, zero, low, high, out))
        for name, topic in contents.topics.items()
    }
    if not topics[states.name].messages:
        raise UserError(f'{path} has no joint states from {low:g} to {high:g} s')
    return write_contents(replace(contents, topics=topics), new)


def _chosen(
    topic: TopicLog, zero: int, low: float, high: float, out: Sequence[tuple[float, float]]
) -> list[Logged]:
    logs = np.array([m.log_ns for m in topic.messages], dtype=np.int64)
    time = (logs - zero) * 1e-9
    first = low if low > 0 else -np.inf
    keep = (time >= first) & (time <= high)
    for a, b in out:
        keep &= (time < a) | (time > b)
    kept = [topic.messages[k] for k in np.flatnonzero(keep)]
    before = np.flatnonzero(time < first)
    if before.size and (LATCHED in topic.qos or topic.type == UINT32):
        kept.insert(0, topic.messages[before[-1]]._replace(log_ns=zero + round(low * 1e9)))
    return kept


def write_contents(contents: BagContents, new: Path) -> int:
    rows = []
    with whole_bag(new, contents.metadata.get('leo')) as writer:
        for topic in contents.topics.values():
            channel = writer.add_topic(topic.name, topic.type, topic.qos)
            rows += [(m.log_ns, channel, m) for m in topic.messages]
        for log_ns, channel, m in sorted(rows, key=itemgetter(0)):
            writer.write(channel, m.data, log_ns, m.published_ns)
    return len(rows)
