# SPDX-License-Identifier: Apache-2.0
"""The cores that this process may use, and work that threads or processes share there."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
import itertools
import multiprocessing.resource_tracker
import os
import signal
from typing import Any, TypeVar

from leo_msgs_py.ending import end_with, SIGNALS

Item = TypeVar('Item')
Result = TypeVar('Result')
_chosen: list[int] = []


def cores() -> int:
    return _chosen[-1] if _chosen else _there()


@contextmanager
def using(number: int | None) -> Iterator[None]:
    """So many cores meanwhile; None for as many as before."""
    _chosen.append(number or cores())
    try:
        yield
    finally:
        _chosen.pop()


@cache
def _there() -> int:
    """As the machine, LOKY_MAX_CPU_COUNT and OMP_NUM_THREADS say."""
    from joblib import cpu_count

    asked = os.environ.get('OMP_NUM_THREADS', '')
    return min(cpu_count(), int(asked) if asked.isdigit() and int(asked) else cpu_count())


def parts(count: int, work: int, least: int) -> list[slice]:
    """Equal parts of `count` things, one for each core, none with less than the `least` work."""
    number = max(min(cores(), count, work // least), 1)
    edges = (count * i // number for i in range(number + 1))
    return [slice(*pair) for pair in itertools.pairwise(edges)]


def at_once(function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """The function of each item, each in a thread of its own.

    joblib's threads take 11 ms to share out what often takes no longer (`Parallel`, two jobs).
    """
    if len(items) < 2:
        return [*map(function, items)]
    with ThreadPoolExecutor(len(items)) as pool:
        return [*pool.map(function, items)]


def in_processes(
    number: int, function: Callable[[Item], Result], items: Iterable[Item], **options: Any
) -> Iterator[Result]:
    """The function of each item by so many processes of one thread, which end with this one.

    `options` are those of joblib's `Parallel`.
    """
    from joblib import delayed, Parallel, parallel_config

    ended = {'initializer': end_with, 'initargs': (os.getpid(),)}  # loky's wait 330 s for it
    with _deaf(), parallel_config('loky', inner_max_num_threads=1, **ended):
        results: Iterator[Result] = Parallel(number, **options)(
            delayed(function)(i) for i in items
        )
        return results


@contextmanager
def _deaf() -> Iterator[None]:
    """Processes that start meanwhile leave it to this one what a terminal's signal ends."""
    from joblib.externals.loky.backend import resource_tracker

    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        for tracker in (resource_tracker, multiprocessing.resource_tracker):
            tracker.ensure_running()
            signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)  # that unblocks two of them
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
