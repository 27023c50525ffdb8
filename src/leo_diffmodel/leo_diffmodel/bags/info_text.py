# SPDX-License-Identifier: Apache-2.0
"""What `leo bag info` prints."""

from __future__ import annotations

from rich.console import Console

from leo_msgs_py.console import Table

from .info import BagInfo, EpisodeInfo

_MANY = 12
_MOST_FACTS = 50


def show(info: BagInfo, console: Console) -> None:
    """Print a summary, the topics and the episodes of a bag."""
    console.print(f'{info.path}: {_STATES[info.state]}', highlight=False)
    console.print(
        f'{info.duration:.2f} s, {info.messages} messages, {info.size / 1e6:.2f} MB',
        highlight=False,
    )
    if info.damaged:
        console.print(f'{info.damaged} damaged places left out', highlight=False)
    for key, value in list(info.metadata.items())[:_MOST_FACTS]:
        console.print(f'{key}: {value}', highlight=False)
    if len(info.metadata) > _MOST_FACTS:
        console.print(f'and {len(info.metadata) - _MOST_FACTS} more facts', highlight=False)
    console.print(_topics(info))
    if info.episodes:
        console.print(
            f'joints {", ".join(info.joints)} at {info.state_rate:.0f} Hz; '
            f'{len(info.episodes)} episode(s){_breaks(info)}',
            highlight=False,
        )
        console.print(_episodes(info.episodes))
    for text in info.told:
        console.print(text, highlight=False)


_STATES = {
    'finished': 'finished',
    'repaired': 'was not finished (the recorder was killed?); finished now, nothing lost',
    'recording': 'being recorded now',
    'unfinished': 'not finished, and the folder is read-only or the disk full; read up to the cut',
    'damaged': 'damaged; left as it is, and read without what is damaged',
}


def _breaks(info: BagInfo) -> str:
    found = [f'{count} x {kind}' for kind, count in info.breaks.items() if kind != 'new episode']
    return f', also split at {", ".join(found)}' if found else ', no gaps'


def _topics(info: BagInfo) -> Table:
    table = Table('topic', 'type')
    table.add_column('messages', justify='right')
    table.add_column('Hz', justify='right')
    for topic in info.topics:
        rate = f'{topic.rate:.1f}' if topic.rate else ''
        table.add_row(topic.name, topic.type, str(topic.count), rate)
    return table


def _episodes(episodes: tuple[EpisodeInfo, ...]) -> Table:
    table = Table()
    for name in ('episode', 'from s', 'to s', 'samples'):
        table.add_column(name, justify='right')
    for number, episode in enumerate(episodes[:_MANY], start=1):
        start, end = f'{episode.start:.3f}', f'{episode.end:.3f}'
        table.add_row(str(number), start, end, str(episode.samples))
    if len(episodes) > _MANY:
        table.add_row(f'and {len(episodes) - _MANY} more', '', '', '')
    return table
