# SPDX-License-Identifier: Apache-2.0
"""A second process that takes its share of a list of trials; the results are those of one."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from itertools import takewhile
import multiprocessing
import os
import time
from typing import Any, NamedTuple, TypeVar

from joblib import cpu_count
from joblib.externals.loky import ProcessPoolExecutor
import numpy as np

from leo_sim.model.window_shares import alone

Item = TypeVar('Item')
Result = TypeVar('Result')
_started: list[Future] = []
_pools: list[ProcessPoolExecutor] = []


def prepare(first: Callable[..., Any], wanted: bool = True) -> None:
    """Begin to start the process, where there is a second core; a worker of others gets none.

    It imports the module of `first`. Not `wanted` where a user's own code may be unfit to be sent.
    """
    _started.clear()
    if wanted and cpu_count() > 1 and multiprocessing.parent_process() is None:
        _started.append(_submit(_ready, first))


def spread(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    done: Callable[[Item], None] = lambda _: None,
) -> list[Result]:
    """`function` of each item, in order; the other process takes its share, sent as copies.

    `done` is called with each item that is.
    """
    return list(spread_until(np.inf, function, items, done).values())


def spread_until(
    until: float,
    function: Callable[[Item], Result],
    items: Sequence[Item],
    done: Callable[[Item], None] = lambda _: None,
) -> dict[int, Result]:
    """As `spread`, by number of the item; none is begun after `until` [s of `time.monotonic`]."""
    results: dict[int, Result] = {}
    waiting, lent = list(range(len(items))), None
    while waiting or lent:
        if time.monotonic() > until:
            waiting.clear()
            if not lent:
                break
        lent = lent or _lend(until, function, items, waiting)
        if lent and (lent.answer.done() or not waiting):
            found, lent = _received(lent, function, items), None
        else:
            number = waiting.pop(0)
            with alone(bool(lent)):
                found = {number: function(items[number])}
        for number in found:
            done(items[number])
        results |= found
    return dict(sorted(results.items()))


class _Lent(NamedTuple):
    numbers: list[int]
    answer: Future


def _lend(
    until: float, function: Callable[[Item], Any], items: Sequence[Item], waiting: list[int]
) -> _Lent | None:
    """Every third of what waits: so both come to the end at about the same time."""
    if len(waiting) < 2 or not _started or not _started[0].done():
        return None
    numbers = waiting[1::3]
    del waiting[1::3]
    return _Lent(numbers, _submit(_each, until, function, [items[number] for number in numbers]))


def _received(
    lent: _Lent, function: Callable[[Item], Any], items: Sequence[Item]
) -> dict[int, Any]:
    try:
        found = lent.answer.result()
    except BrokenProcessPool:  # it was killed, for memory perhaps
        _started.clear()
        _pools.clear()
        found = _each(np.inf, function, [items[number] for number in lent.numbers])
    return dict(zip(lent.numbers, found, strict=False))


def _submit(function: Callable[..., Any], *arguments: Any) -> Future:
    """By a pool of its own: joblib does not share its reusable one."""
    if not _pools:
        _pools.append(ProcessPoolExecutor(max_workers=1, timeout=60))  # s without work
    try:
        return _pools[0].submit(function, *arguments)
    except BrokenProcessPool:  # it was killed while it waited
        _pools.clear()
        return _submit(function, *arguments)


def _ready(_first: Callable[..., Any]) -> None:
    """Keep to one core. That the function could be received means that its module is imported."""
    os.environ['OMP_NUM_THREADS'] = '1'


def _each(until: float, function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Of the first items, as many as there is time for; the clock is that of all processes."""
    return [function(item) for item in takewhile(lambda _: time.monotonic() < until, items)]
