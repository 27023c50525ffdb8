# SPDX-License-Identifier: Apache-2.0
"""Windows shared out over the cores of this process, where their physics is compiled."""

from collections.abc import Callable, Mapping, Sequence
import math
from typing import Any, NamedTuple, TypeVar

import numpy as np

from leo_sim.common.cores import at_once, parts

LEAST_INTERVALS = 200  # fewer than these in a share are not worth a thread

T = TypeVar('T')
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
    cut = parts(count, lead * count * steps, LEAST_INTERVALS) if _loaded else [slice(count)]
    _loaded.append(True)
    return at_once(work, [batch.part(each) for each in cut])


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
