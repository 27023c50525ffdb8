# SPDX-License-Identifier: Apache-2.0
"""What is held over the sample periods of windows, and its values as the kernel takes them."""
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array
from leo_sim.laws.laws import Memory


class Held(NamedTuple):
    """What is held over K sample periods.

    Attributes:
        inputs: V, N m or rad, (..., W, K, A).
        periods: s, (W, K).
        enabled: Booleans (..., W, K, A), or None for all motors on.
        push: Extra torque on the links, N m, (..., W, K, J), or None.
        memory: What the effects remember; it stays.
    """

    inputs: Array
    periods: Array
    enabled: Any
    push: Any
    memory: Memory

    @property
    def on(self) -> Any:
        """Which motors are on, samples first as the inputs; None for all."""
        free = self.enabled is not None and not np.all(self.enabled)
        return samples_first(self.enabled) if free else None


def samples_first(values: Any) -> Any:
    """Values (..., W, K, A) as (K, ..., W, A), with an axis for what is scanned."""
    first = np.moveaxis(np.asarray(values), -2, 0)
    return first if first.ndim > 3 else first[:, None]


def every_row(values: Array, shape: tuple[int, ...], tail: int) -> Any:
    """Values (K, S, W, tail), or less of that, for all rows: (K, N, tail)."""
    full = np.broadcast_to(values, (*shape, tail))
    return np.ascontiguousarray(full).reshape(shape[0], -1, tail)
