# SPDX-License-Identifier: Apache-2.0
"""How far many cases are, and how long the others will take."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import sys
import time
from typing import TypeVar

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from leo_msgs_py.console import Terminal

Row = TypeVar('Row')
REMEMBERED = 6 * 3600.0
"""How long the speed of cases counts for the time left [s]; single ones differ much."""


def counted(rows: Iterable[Row], done: int, total: int, title: str) -> Iterator[Row]:
    """Give rows on; say on stderr how many there are and the time left.

    A terminal has a bar, a log file a line at each hundredth.

    Args:
        rows: one for each case, as they come.
        done: cases that were there before.
        total: all cases, those included.
        title: what they are.
    """
    console = Terminal(stderr=True)
    if not console.is_terminal:
        yield from _logged(rows, done, total, title)
        return
    columns = (
        TextColumn('{task.description}', markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn('left'),
    )
    with Progress(*columns, console=console, speed_estimate_period=REMEMBERED) as bar:
        task = bar.add_task(title, total=total, completed=done)
        for row in rows:
            bar.advance(task)
            yield row


def _logged(rows: Iterable[Row], done: int, total: int, title: str) -> Iterator[Row]:
    began = time.monotonic()
    for count, row in enumerate(rows, start=1):
        now = done + count
        if 100 * now // total > 100 * (now - 1) // total:
            left = (time.monotonic() - began) / count * (total - now) / 3600
            print(f'{title}: {now} of {total}, about {left:.1f} h left', file=sys.stderr)
        yield row
