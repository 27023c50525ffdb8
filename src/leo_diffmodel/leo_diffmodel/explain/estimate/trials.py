# SPDX-License-Identifier: Apache-2.0
"""A list of trials on all cores, by joblib's processes; the results are those of one core."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
import multiprocessing
from threading import Event, Thread
import time
from typing import Any, TypeVar

from joblib.externals.loky.process_executor import TerminatedWorkerError
import numpy as np

from leo_sim.common.cores import cores, in_processes

Item = TypeVar('Item')
Result = TypeVar('Result')


class Processes:
    """A process for each core: they start with a list that comes after some work."""

    def __init__(self, first: Callable[..., Any], after: float) -> None:
        self._begin, self._from = partial(_begin, first), time.process_time() + after
        self.start, self.there = Thread(target=self._started), Event()

    def ready(self) -> bool:
        """Whether they have started; they are told to where it is time."""
        if self.start.ident is None and time.process_time() >= self._from:
            self.start.start()
        return self.there.is_set()

    def _started(self) -> None:
        with suppress(TerminatedWorkerError):
            deque(_parallel(self._begin, range(cores())), 0)
            self.there.set()


_processes: list[Processes] = []


@contextmanager
def by_processes(first: Callable[..., Any], after: float, able: bool = True) -> Iterator[None]:
    """Send trials to a process for each core meanwhile, once these have started.

    They start with a list that comes when this process has worked `after` s, and import the module
    of `first`. Not `able` where a user's own code may be unfit to be sent.
    """
    able = able and cores() > 1 and not multiprocessing.current_process().daemon
    _processes.append(Processes(first, after if able else np.inf))
    try:
        yield
    finally:
        if (start := _processes.pop().start).is_alive():
            start.join()


def spread(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    done: Callable[[Item], None] = lambda _: None,
) -> list[Result]:
    """`function` of each item, in order; processes have copies. `done` is called with each."""
    return list(spread_until(np.inf, function, items, done).values())


def spread_until(
    until: float,
    function: Callable[[Item], Result],
    items: Sequence[Item],
    done: Callable[[Item], None] = lambda _: None,
) -> dict[int, Result]:
    """As `spread`, by number of the item; none is begun after `until` [s of `time.monotonic`]."""
    results: dict[int, Result] = {}
    for number, found in enumerate(_each(partial(_in_time, until, function), items)):
        if found:
            (results[number],) = found
            done(items[number])
    return results


def _each(function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
    """Where a process is killed, for memory perhaps, all that is left is done here."""
    count = 0
    while count < len(items):
        if not (items[count + 1 :] and _processes and _processes[-1].ready()):
            yield function(items[count])
            count += 1
            continue
        try:
            for result in _parallel(function, items[count:]):
                yield result
                count += 1
        except TerminatedWorkerError:
            _processes[-1].there.clear()


def _parallel(function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
    several = max(1, len(items) // (4 * cores()))  # each batch has a copy of the function's data
    # no memory maps: these are read-only, and compiled code would be compiled anew for them
    options = {'return_as': 'generator', 'batch_size': several, 'max_nbytes': None}
    return in_processes(cores(), function, items, **options)


def _in_time(until: float, function: Callable[[Item], Result], item: Item) -> list[Result]:
    """The clock is that of all processes."""
    return [function(item)] if time.monotonic() < until else []


def _begin(_first: Callable[..., Any], _: int) -> None:
    """That the function could be received means that its module is imported."""
