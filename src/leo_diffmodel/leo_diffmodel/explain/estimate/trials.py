# SPDX-License-Identifier: Apache-2.0
"""A list of trials on all cores, by joblib's processes; the results are those of one core."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
import multiprocessing
from threading import Timer
import time
from typing import Any, TypeVar

from joblib import delayed
from joblib.externals.loky.process_executor import TerminatedWorkerError
import numpy as np

from leo_sim.common.cores import cores, processes

Item = TypeVar('Item')
Result = TypeVar('Result')
_starts: list[Timer] = []


@contextmanager
def by_processes(first: Callable[..., Any], after: float, able: bool = True) -> Iterator[None]:
    """Send trials to a process for each core meanwhile, once these have started.

    They are begun `after` s, and import the module of `first`. Not `able` where a user's own code
    may be unfit to be sent.
    """
    start = Timer(after, lambda: deque(_parallel(partial(_begin, first), range(cores())), 0))
    _starts.append(start)
    if able and cores() > 1 and not multiprocessing.current_process().daemon:
        start.start()
    try:
        yield
    finally:
        _starts.pop().cancel()
        if start.is_alive():
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
        if not (_starts and _starts[-1].finished.is_set() and items[count + 1 :]):
            yield function(items[count])
            count += 1
            continue
        try:
            for result in _parallel(function, items[count:]):
                yield result
                count += 1
        except TerminatedWorkerError:
            _starts[-1].finished.clear()


def _parallel(function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
    several = max(1, len(items) // (4 * cores()))  # each batch has a copy of the function's data
    # no memory maps: these are read-only, and compiled code would be compiled anew for them
    parallel = processes(cores(), return_as='generator', batch_size=several, max_nbytes=None)
    results: Iterator[Result] = parallel(delayed(function)(item) for item in items)
    return results


def _in_time(until: float, function: Callable[[Item], Result], item: Item) -> list[Result]:
    """The clock is that of all processes."""
    return [function(item)] if time.monotonic() < until else []


def _begin(_first: Callable[..., Any], _: int) -> None:
    """That the function could be received means that its module is imported."""
