# SPDX-License-Identifier: Apache-2.0
"""What is being done and how long it may still take, on a terminal and where nobody watches."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
import sys
import time
from typing import Protocol

from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

from leo_msgs_py.console import Terminal

EVERY = 10.0
"""Between lines where nobody watches a terminal, s."""
FEWEST = 3
"""Steps after which the time left is guessed."""


@dataclass
class Clock:
    """Steps done, and what they say of the time left.

    Attributes:
        steps: about how many there will be; None where nobody knows.
        now: the time [s].
    """

    steps: int | None
    now: Callable[[], float] = time.monotonic
    done: int = 0
    began: float = field(init=False)
    last: float = field(init=False)

    def __post_init__(self) -> None:
        self.began = self.last = self.now()

    def step(self, steps: int = 1) -> None:
        """One step more is done, or several."""
        self.done, self.last = self.done + steps, self.now()

    @property
    def elapsed(self) -> float:
        """Since the beginning [s]."""
        return self.now() - self.began

    @property
    def left(self) -> float | None:
        """Guess of the time left [s]; no less than the step takes that is being done.

        None where too little is known: at the beginning, and after more steps than expected.
        """
        if self.steps is None or not FEWEST <= self.done < self.steps:
            return None
        pace = (self.last - self.began) / self.done
        return max(pace * (self.steps - self.done), self.now() - self.last)

    def __str__(self) -> str:
        told = '' if self.left is None else f', about {in_words(self.left)} left'
        return f'{in_words(self.elapsed)}{told}'


def in_words(seconds: float) -> str:
    """A time that nobody knows to the second."""
    return f'{seconds:.0f} s' if seconds < 100 else f'{seconds / 60:.0f} min'


class _Left(ProgressColumn):
    """The time left of a clock."""

    def __init__(self, clock: Clock) -> None:
        super().__init__()
        self._clock = clock

    def render(self, task: Task) -> Text:
        """In words; nothing where it is not known."""
        left = self._clock.left
        return Text('' if left is None else f'about {in_words(left)} left')


class Told(Protocol):
    """Hears what has been done, and how many steps that were."""

    def __call__(self, text: str, steps: int = 1) -> None:
        """One step is done, or several."""


@contextmanager
def progress(title: str, steps: int | None = None) -> Iterator[Told]:
    """Tell on stderr what is being done and, where `steps` says how much, the time left."""
    console, clock = Terminal(stderr=True), Clock(steps)
    if not console.is_terminal:
        yield _lines(title, clock)
        return
    what = TextColumn('{task.description}', markup=False)
    columns = (SpinnerColumn(), what, BarColumn(), TimeElapsedColumn(), _Left(clock))
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(title, total=steps)

        def told(text: str, steps: int = 1) -> None:
            clock.step(steps)
            bar.update(task, advance=steps, description=f'{title}: {text}')

        yield told


def _lines(title: str, clock: Clock) -> Told:
    """Print a line every `EVERY` seconds."""
    printed = clock.began

    def told(text: str, steps: int = 1) -> None:
        nonlocal printed
        clock.step(steps)
        if clock.last - printed >= EVERY:
            printed = clock.last
            print(f'{title}: {text} ({clock})', file=sys.stderr, flush=True)

    return told
