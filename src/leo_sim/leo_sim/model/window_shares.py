# SPDX-License-Identifier: Apache-2.0
"""Windows shared out over the cores of this process, where their physics is compiled."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
import itertools
import math
import os
from typing import Any, NamedTuple, TypeVar

import numpy as np

LEAST_INTERVALS = 200  # fewer than these in a share are not worth a thread

T = TypeVar('T')
_alone: list[bool] = []
_loaded: list[bool] = []  # compiled code is loaded by one thread: two at once compile it again

AXES = {1: ('start', 'held'), 2: ('q0', 'dq0', 'periods'), 3: ('inputs', 'enabled', 'push')}
AXES_OF_HISTORY = {2: ('dt',), 3: ('q', 'dq', 'inputs', 'enabled')}
"""Fields by which of their axes, from the end, is that of the windows."""


class Batch(NamedTuple):
    """The arguments of a rollout of W windows; see `leo_sim.model.batch.rollout`."""

    q0: Any
    dq0: Any
    inputs: Any
    periods: Any
    enabled: Any
    history: Any
    push: Any
    start: Any
    held: Any

    def part(self, windows: slice) -> 'Batch':
        past = None if self.history is None else _part(self.history, windows, AXES_OF_HISTORY)
        return _part(self, windows, AXES)._replace(history=past)


def shares(work: Callable[[Batch], T], batch: Batch) -> list[T]:
    """The work on equal shares of the windows, one for each core, in order."""
    count, steps = batch.periods.shape
    lead = max(math.prod(batch.q0.shape[:-2]), math.prod(batch.inputs.shape[:-3]))
    number = int(min(cores(), count, lead * count * steps // LEAST_INTERVALS))
    if number < 2 or not _loaded:
        _loaded.append(True)
        return [work(batch)]
    edges = np.linspace(0, count, number + 1).astype(int)
    parts = [batch.part(slice(a, b)) for a, b in itertools.pairwise(edges)]
    with ThreadPoolExecutor(number) as pool:
        return list(pool.map(work, parts))


@contextmanager
def alone(wanted: bool = True) -> Iterator[None]:
    """Rollouts keep to one core meanwhile: another process is at work on the others."""
    _alone.append(wanted)
    try:
        yield
    finally:
        _alone.pop()


def cores() -> int:
    """How many cores this process may use; OMP_NUM_THREADS limits them."""
    if any(_alone):
        return 1
    there = len(os.sched_getaffinity(0))
    asked = os.environ.get('OMP_NUM_THREADS', '')
    return min(there, int(asked)) if asked.isdigit() and int(asked) > 0 else there


def _part(whole: Any, windows: slice, axes: Mapping[int, Sequence[str]]) -> Any:
    for axis, names in axes.items():
        cut = {name: _axis(getattr(whole, name), windows, axis) for name in names}
        whole = whole._replace(**cut)
    return whole


def _axis(values: Any, windows: slice, from_end: int) -> Any:
    """Values with their window axis cut, the one `from_end` from the end; None stays None."""
    if values is None:
        return None
    index = (..., windows, *(slice(None),) * (from_end - 1))
    values = np.asarray(values)
    return values if values.ndim < from_end else values[index]
