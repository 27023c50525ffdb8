# SPDX-License-Identifier: Apache-2.0
"""The console of every verb: tables and progress, in which names are text and nothing else."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from copy import copy
from dataclasses import dataclass, field
import math
import sys
from threading import Event, Thread
import time
from typing import Any, IO

from rich import progress as bars
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Column
from rich.table import Table as RichTable
from rich.text import Text

from leo_msgs_py.terminal import visible

EVERY = 10.0  # between lines where nobody watches a terminal, s
FEWEST = 2  # steps of a kind after which their time is guessed
LEAST = 1.0  # of what is said to be left [s]
GROWS = 1.2  # times what was said to be left, that may be said later


class Terminal(Console):
    """A rich console that obeys neither markup nor control codes in what it prints."""

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, **options)

    @property
    def file(self) -> IO[str]:
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
    """A table that folds names and numbers where it is too wide for the terminal, never cuts.

    Before that it leaves out its last columns, up to `spare`, and says so below.
    """

    def __init__(
        self, *headers: Any, rows: Iterable[Iterable[str]] = (), spare: int = 0, **options: Any
    ) -> None:
        super().__init__(*headers, **options)
        self._spare = spare
        for row in rows:
            self.add_row(*row)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterable[Any]:
        for column in (c for c in self.columns if c.no_wrap):
            lines = '\n'.join(map(str, (column.header, *column.cells))).split('\n')
            width = max(map(cell_len, lines))
            fits = width <= options.max_width // 2  # what is wider leaves no room
            column.no_wrap, column.overflow = fits, 'fold'
            column.min_width = width if fits else None
        shown, wide = copy(self), options.update(max_width=sys.maxsize)
        for count in range(self._spare + 1):
            shown.columns = self.columns[: len(self.columns) - count]
            if shown.__rich_measure__(console, wide).minimum <= options.max_width:
                break
        if left_out := [str(column.header) for column in self.columns[len(shown.columns) :]]:
            said = f'left out for want of width: {listed(left_out)}'
            shown.caption = '; '.join(filter(None, [str(self.caption or ''), said]))
        yield from RichTable.__rich_console__(shown, console, options)

    def add_column(self, *header: Any, **options: Any) -> None:
        super().add_column(*header, **{'overflow': 'fold', **options})


def figures(*headers: str, **options: Any) -> list[Column]:
    """Columns of numbers, to the right, for a `Table`; `options` go to rich."""
    return [Column(header, justify='right', overflow='fold', **options) for header in headers]


@dataclass
class Pace:
    """Steps of one kind: those done, in what time [s], and about how many are to come."""

    done: int = 0
    seconds: float = 0.0
    ahead: int = 0

    @property
    def left(self) -> float:
        """Time for those to come [s], with a margin that melts: few steps say little of others."""
        return self.ahead * self.seconds / self.done * (1 + self.done**-0.5)


@dataclass
class Clock:
    """Steps done, and what those of the same kind say of the time left."""

    steps: int | None = None  # about how many of no kind there will be, where somebody knows
    now: Callable[[], float] = time.monotonic  # [s]
    within: float = math.inf  # they end in any case after this time [s]
    paces: dict[str, Pace] = field(default_factory=dict)  # by kind
    began: float = field(init=False)
    last: float = field(init=False)
    _said: float = field(default=math.inf, init=False)  # the least time left that was said [s]

    def __post_init__(self) -> None:
        self.began = self.last = self.now()
        self.expect({'': self.steps or 0})

    def step(self, steps: int = 1, kind: str = '') -> None:
        """So many steps took the time since the last call; where none, that time is nobody's."""
        pace, now = self.paces.setdefault(kind, Pace()), self.now()
        pace.done, pace.ahead = pace.done + steps, max(pace.ahead - steps, 0)
        pace.seconds += (now - self.last) if steps else 0.0
        self.last = now

    def expect(self, ahead: Mapping[str, int]) -> None:
        """About so many more steps of each kind are to come."""
        for kind, steps in ahead.items():
            self.paces.setdefault(kind, Pace()).ahead = steps

    @property
    def elapsed(self) -> float:
        return self.now() - self.began

    @property
    def left(self) -> float | None:
        """Guess of the time left [s]; no less than the step takes that is being done.

        None where too little is known: before steps of every kind that is to come were seen, after
        more steps than expected, and where it would be more than was said before.
        """
        ahead = [pace for pace in tuple(self.paces.values()) if pace.ahead]
        if not ahead or any(pace.done < FEWEST for pace in ahead):
            return None
        guess = max(sum(pace.left for pace in ahead), self.now() - self.last)
        guess = min(guess, self.within - self.elapsed)
        if not LEAST < guess < GROWS * self._said:
            return None
        self._said = min(self._said, guess)
        return self._said

    @property
    def rest(self) -> str:
        """The time left in words; '' where nothing is known of it."""
        left, most = self.left, self.within - self.elapsed
        if left is not None:
            return f'about {in_words(left)} left'
        return f'at most {in_words(most)} left' if LEAST < most < math.inf else ''

    def __str__(self) -> str:
        return ', '.join(filter(None, [in_words(self.elapsed), self.rest]))


def in_words(seconds: float) -> str:
    """A time that nobody knows to the second."""
    return f'{seconds:.0f} s' if seconds < 100 else f'{seconds / 60:.0f} min'


def listed(names: Sequence[str], most: int = 3) -> str:
    rest = f' and {len(names) - most} more' if len(names) > most else ''
    return f'{", ".join(names[:most])}{rest}'


class _Left(bars.ProgressColumn):
    def __init__(self, clock: Clock) -> None:
        super().__init__(Column(no_wrap=True))
        self._clock = clock

    def render(self, task: bars.Task) -> Text:
        return Text(self._clock.rest)


@dataclass
class Reporter:
    """Is told what has been done, how many steps of what kind that were, and what is to come."""

    show: Callable[[str], None]  # shows what is being done
    clock: Clock = field(default_factory=Clock)

    @classmethod
    def of(cls, show: Callable[[str], None]) -> 'Reporter':
        return show if isinstance(show, Reporter) else cls(show)

    def __call__(self, text: str, steps: int = 1, kind: str = '') -> None:
        self.clock.step(steps, kind)
        self.show(text)

    def expect(self, ahead: Mapping[str, int]) -> None:
        self.clock.expect(ahead)


@contextmanager
def progress(title: str, steps: int | None = None, within: float = math.inf) -> Iterator[Reporter]:
    """Say on stderr what is being done, and the time left by what about so many steps take.

    `within` is after how long it ends in any case [s].
    """
    console, clock = Terminal(stderr=True), Clock(steps, within=within)
    shown = _bar(title, clock, console) if console.is_terminal else _lines(title, clock)
    with shown as show:
        yield Reporter(show, clock)


@contextmanager
def _bar(title: str, clock: Clock, console: Terminal) -> Iterator[Callable[[str], None]]:
    what = bars.TextColumn('{task.description}', markup=False)
    parts = (bars.SpinnerColumn(), what, bars.BarColumn(), bars.TimeElapsedColumn(), _Left(clock))
    with bars.Progress(*parts, console=console, transient=True) as bar:
        task = bar.add_task(title, total=None)

        def show(text: str) -> None:
            left, done = clock.left, clock.elapsed
            total = None if left is None else done + left
            bar.update(task, total=total, completed=done, description=f'{title}: {text}')

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
