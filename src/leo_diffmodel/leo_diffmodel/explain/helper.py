# SPDX-License-Identifier: Apache-2.0
"""A second process that takes half of a list of trials; the results are those of one process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
import multiprocessing
from typing import Any, TypeVar

from joblib import cpu_count
from joblib.externals.loky import ProcessPoolExecutor

Item = TypeVar('Item')
Result = TypeVar('Result')
IDLE_SECONDS = 60
_started: list[Future] = []
_pools: list[ProcessPoolExecutor] = []


def prepare(wanted: bool = True) -> None:
    """Begin to start the process, where there is a second core; a worker of others gets none.

    Args:
        wanted: False where what is tried may not be fit to be sent, such as a user's own code.
    """
    _started.clear()
    if wanted and cpu_count() > 1 and multiprocessing.parent_process() is None:
        _started.append(_submit(_imported))


def spread(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    told: Callable[[Item], None] = lambda _: None,
) -> list[Result]:
    """`function` of each item, in order, half of them by the other process once it is there.

    Args:
        function: what to do; what it needs and gives is sent as a copy.
        items: its arguments.
        told: called with each item that is done.
    """
    if len(items) < 2 or not _started or not _started[0].done():
        return _each(function, items, told)
    theirs = _submit(_each, function, items[1::2])
    results: list[Any] = [None] * len(items)
    results[::2] = _each(function, items[::2], told)
    try:
        results[1::2] = theirs.result()
    except BrokenProcessPool:  # it was killed, for memory perhaps
        _started.clear()
        _pools.clear()
        return results[:1] + spread(function, items[1:], told)
    for item in items[1::2]:
        told(item)
    return results


def _submit(function: Callable[..., Any], *arguments: Any) -> Future:
    """By a pool of its own: joblib does not share its reusable one."""
    if not _pools:
        _pools.append(ProcessPoolExecutor(max_workers=1, timeout=IDLE_SECONDS))
    try:
        return _pools[0].submit(function, *arguments)
    except BrokenProcessPool:  # it was killed while it waited
        _pools.clear()
        return _submit(function, *arguments)


def _imported() -> None:
    """What takes longest to start: the modules that the trials need."""
    import leo_diffmodel.explain.engine  # noqa: F401


def _each(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    told: Callable[[Item], None] = lambda _: None,
) -> list[Result]:
    results = []
    for item in items:
        results.append(function(item))
        told(item)
    return results
