# SPDX-License-Identifier: Apache-2.0
"""The console of every verb: tables and progress, in which names are text and nothing else."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
import math
import sys
from threading import Event, Thread
import time
from typing import Any, IO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.segment import Segment
from rich.table import Column
from rich.table import Table as RichTable
from rich.text import Text

from leo_msgs_py.terminal import visible

EVERY = 10.0  # between lines where nobody watches a terminal, s
FEWEST = 3  # steps after which the time left is guessed


class Terminal(Console):
    """A rich console that obeys neither markup nor control codes in what it prints."""

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, **options)

    @property
    def file(self) -> IO[str]:
        """Where it writes: past `terminal.Output`, also where a bar stands before that."""
        file = super().file
        return getattr(file, 'rich_proxied_file', file)

    @file.setter
    def file(self, new: IO[str]) -> None:
        Console.file.fset(self, new)  # type: ignore[attr-defined]

    def render_str(self, text: str, **options: Any) -> Text:
        return super().render_str(visible(text), **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=visible(segment.text))


class Table(RichTable):
    """A table that folds names and numbers where it is too wide for the terminal, never cuts."""

    def add_column(self, *header: Any, **options: Any) -> None:
        super().add_column(*header, **{'overflow': 'fold', **options})


def figures(*headers: str, **options: Any) -> list[Column]:
    """Columns of numbers, to the right, for a `Table`; `options` go to rich."""
    return [Column(header, justify='right', overflow='fold', **options) for header in headers]


@dataclass
class Clock:
    """Steps done, and what they say of the time left."""

    steps: int | None = None  # about how many there will be, where somebody knows
    now: Callable[[], float] = time.monotonic  # [s]
    within: float = math.inf  # they end in any case after this time [s]
    done: int = 0
    began: float = field(init=False)
    last: float = field(init=False)

    def __post_init__(self) -> None:
        self.began = self.last = self.now()

    def step(self, steps: int = 1) -> None:
        self.done, self.last = self.done + steps, self.now()

    @property
    def elapsed(self) -> float:
        return self.now() - self.began

    @property
    def left(self) -> float | None:
        """Guess of the time left [s]; no less than the step takes that is being done.

        None where too little is known: at the beginning, and after more steps than expected.
        """
        if self.steps is None or not FEWEST <= self.done < self.steps:
            return None
        pace = (self.last - self.began) / self.done
        guess = max(pace * (self.steps - self.done), self.now() - self.last)
        return min(guess, max(self.within - self.elapsed, 0.0))

    def __str__(self) -> str:
        known = self.steps is not None and self.done <= self.steps
        part = f'{self.done} of about {self.steps} steps in ' if known else ''
        rest = '' if self.left is None else f', about {in_words(self.left)} left'
        return f'{part}{in_words(self.elapsed)}{rest}'


def in_words(seconds: float) -> str:
    """A time that nobody knows to the second."""
    return f'{seconds:.0f} s' if seconds < 100 else f'{seconds / 60:.0f} min'


class _Left(ProgressColumn):
    def __init__(self, clock: Clock) -> None:
        super().__init__()
        self._clock = clock

    def render(self, task: Task) -> Text:
        left = self._clock.left
        return Text('' if left is None else f'about {in_words(left)} left')


@dataclass
class Reporter:
    """Is told what has been done, how many steps that were, and how many are to come."""

    show: Callable[[str], None]  # shows what is being done
    clock: Clock = field(default_factory=Clock)

    @classmethod
    def of(cls, show: Callable[[str], None]) -> Reporter:
        """What shows texts as a reporter; one that counts steps stays as it is."""
        return show if isinstance(show, Reporter) else cls(show)

    def __call__(self, text: str, steps: int = 1) -> None:
        self.clock.step(steps)
        self.show(text)

    def expect(self, steps: int) -> None:
        """About so many more steps are to come."""
        self.clock.steps = self.clock.done + steps


@contextmanager
def progress(title: str, steps: int | None = None, within: float = math.inf) -> Iterator[Reporter]:
    """Say on stderr what is being done, how much of about so many steps, and the time left.

    `within` is after how long it ends in any case [s].
    """
    console, clock = Terminal(stderr=True), Clock(steps, within=within)
    shown = _bar(title, clock, console) if console.is_terminal else _lines(title, clock)
    with shown as show:
        yield Reporter(show, clock)


@contextmanager
def _bar(title: str, clock: Clock, console: Terminal) -> Iterator[Callable[[str], None]]:
    what = TextColumn('{task.description}', markup=False)
    columns = (SpinnerColumn(), what, BarColumn(), TimeElapsedColumn(), _Left(clock))
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(title, total=clock.steps)

        def show(text: str) -> None:
            about = f'{title}: {text}'
            bar.update(task, total=clock.steps, completed=clock.done, description=about)

        yield show


@contextmanager
def _lines(title: str, clock: Clock) -> Iterator[Callable[[str], None]]:
    """A line every `EVERY` seconds, however long a step takes."""
    said, over = deque([title], maxlen=1), Event()

    def lines() -> None:
        while not over.wait(EVERY):
            with suppress(OSError, ValueError):  # nobody reads any more
                print(f'{said[-1]} ({clock})', file=sys.stderr, flush=True)

    thread = Thread(target=lines, daemon=True)
    thread.start()
    try:
        yield lambda text: said.append(f'{title}: {text}')
    finally:
        over.set()
        thread.join()
