# SPDX-License-Identifier: Apache-2.0
"""What is in a bag: topics, rates, episodes, gaps, and whether it was finished."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Column

from leo_msgs_py.bag_contents import BagContents, load, TopicLog
from leo_msgs_py.console import figures, Table
from leo_msgs_py.errors import UserError

from .finish import finish_bag
from .publishers import FEWEST
from .split import split
from .states import deserialize, read_states, StateLog
from .topic_map import DEFAULT_NAMES, TopicMap
from .types import JOINT_STATE

_APART = 0.05  # of the time on the recorder's clock, from which on that of the robot is told
_MANY = 12
_MOST_FACTS = 50
_STATES = {
    'finished': 'finished',
    'repaired': 'was not finished (the recorder was killed?); finished now, with what was written',
    'recording': 'being recorded now',
    'unfinished': 'not finished, and the folder is read-only or the disk full; read up to the cut',
    'damaged': 'damaged; left as it is, and read without what is damaged',
}


@dataclass(frozen=True)
class TopicInfo:
    """One topic; rate in messages per second of log time."""

    name: str
    type: str
    count: int
    rate: float


@dataclass(frozen=True)
class EpisodeInfo:
    """One unbroken stretch of joint states [s since the first], and how many they are."""

    start: float
    end: float
    samples: int


@dataclass(frozen=True)
class BagInfo:
    path: Path
    state: str  # a key of `_STATES`
    size: int  # bytes
    duration: float  # log time from the first to the last message [s]
    messages: int
    topics: tuple[TopicInfo, ...]
    joints: tuple[str, ...]
    state_rate: float  # joint states per second of robot time
    episodes: tuple[EpisodeInfo, ...]
    breaks: Mapping[str, int]  # how often each kind of break came
    metadata: Mapping[str, str]  # the `leo` record
    damaged: int = 0  # records and chunks that do not read, or have a wrong checksum
    told: tuple[str, ...] = ()  # of several publishers, or why no states were read


def bag_info(path: Path) -> BagInfo:
    try:
        state = finish_bag(path).value
    except OSError:
        state = 'unfinished'
    contents = load(path)
    logged = [m.log_ns for topic in contents.topics.values() for m in topic.messages]
    joints, states, notes = _states(contents)
    rate, episodes, breaks = _parts(contents, states) if states else (0.0, (), {})
    return BagInfo(
        path=path,
        state=state if contents.finished or state != 'finished' else 'unfinished',
        size=sum(file.stat().st_size for file in contents.files),
        duration=(max(logged) - min(logged)) * 1e-9 if logged else 0.0,
        messages=contents.message_count,
        topics=tuple(_topic(topic) for _, topic in sorted(contents.topics.items())),
        joints=joints,
        state_rate=rate,
        episodes=episodes,
        breaks=breaks,
        metadata=contents.metadata.get('leo', {}),
        damaged=contents.damaged,
        told=notes,
    )


def _topic(topic: TopicLog) -> TopicInfo:
    times = [message.log_ns for message in topic.messages]
    span = (times[-1] - times[0]) * 1e-9 if times else 0.0
    rate = (len(times) - 1) / span if span > 0 else 0.0
    return TopicInfo(topic.name, topic.type, len(times), rate)


def _states(contents: BagContents) -> tuple[tuple[str, ...], StateLog | None, tuple[str, ...]]:
    topics = [topic for topic in contents.of_type(JOINT_STATE) if len(topic.messages) > 1]
    why = ''
    for topic in sorted(topics, key=lambda each: each.name != DEFAULT_NAMES['joint_states']):
        joints = _joints(topic)
        try:
            states = read_states(topic, joints, TopicMap()) if joints else None
        except UserError as error:
            why = why or str(error)
            continue
        if states is not None and len(states.q) > 1:
            return joints, states, states.notes
    return (), None, (why,) if why else ()


def _joints(topic: TopicLog) -> tuple[str, ...]:
    messages = (message for _, message in deserialize(topic, JOINT_STATE))
    often = Counter((m.header.frame_id, *m.name) for m in messages)  # which keeps their order
    kinds = (names for (_, *names), n in often.items() if n >= FEWEST or len(often) == 1)
    return tuple(dict.fromkeys(chain.from_iterable(kinds)))


def _parts(
    contents: BagContents, states: StateLog
) -> tuple[float, tuple[EpisodeInfo, ...], Mapping[str, int]]:
    segments = split(states, contents.topics.get(DEFAULT_NAMES['episode']))
    steps = np.diff(states.stamp_ns)
    rate = float(1e9 / np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    t = ((states.stamp_ns - states.stamp_ns[0]) * 1e-9).tolist()
    episodes = (EpisodeInfo(t[s.start], t[s.stop - 1], s.stop - s.start) for s in segments.slices)
    return rate, tuple(episodes), {kind: n for kind, n in segments.breaks.items() if n}


def show(info: BagInfo, console: Console) -> None:
    write = partial(console.print, highlight=False)
    write(f'{info.path}: {_STATES[info.state]}')
    on_clock, own = f'{info.duration:.2f} s', sum(e.end - e.start for e in info.episodes)
    if own and abs(own - info.duration) > _APART * info.duration:
        on_clock += f" on the recorder's clock, {own:.2f} s of states on the robot's"
    write(f'{on_clock}, {info.messages} messages, {info.size / 1e6:.2f} MB')
    if info.damaged:
        write(f'{info.damaged} damaged places left out')
    if lost := info.metadata.get('lost'):
        write(f'{lost} messages were lost while it was recorded')
    for key, value in list(info.metadata.items())[:_MOST_FACTS]:
        write(f'{key}: {value}')
    if len(info.metadata) > _MOST_FACTS:
        write(f'and {len(info.metadata) - _MOST_FACTS} more facts')
    name, kind = (Column(head, no_wrap=True) for head in ('topic', 'type'))
    caption = "Hz: on the recorder's clock"
    table = Table(name, *figures('messages', 'Hz'), kind, caption=caption, spare=1)
    for topic in info.topics:
        rate = f'{topic.rate:.1f}' if topic.rate else ''
        table.add_row(topic.name, str(topic.count), rate, topic.type.replace('/msg/', '/'))
    console.print(table)
    if info.episodes:
        found = [f'{n} x {kind}' for kind, n in info.breaks.items() if kind != 'new episode']
        also = f'also split at {", ".join(found)}' if found else 'no gaps'
        write(
            f'joints {", ".join(info.joints)} at {info.state_rate:.0f} Hz of the robot; '
            f'{len(info.episodes)} episode(s), {also}'
        )
        console.print(_episode_table(info.episodes))
    for text in info.told:
        write(text)


def _episode_table(episodes: tuple[EpisodeInfo, ...]) -> Table:
    table = Table(*figures('episode', 'from s', 'to s', 'samples'))
    for number, episode in enumerate(episodes[:_MANY], start=1):
        start, end = f'{episode.start:.3f}', f'{episode.end:.3f}'
        table.add_row(str(number), start, end, str(episode.samples))
    if len(episodes) > _MANY:
        table.add_row(f'and {len(episodes) - _MANY} more', '', '', '')
    return table
