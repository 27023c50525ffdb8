# SPDX-License-Identifier: Apache-2.0
"""Broadcasting in the inner loop: NumPy's own functions cost more there than the copy."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Numbers = float | Array
"""A float, or an array that broadcasts with the others."""


def filled(shape: tuple[int, ...], values: Numbers) -> Any:
    """A new array of that shape filled with values that broadcast to it."""
    result = np.empty(shape)
    result[...] = values
    return result


def paired(first: Numbers, second: Numbers) -> Any:
    """Both side by side along a new first axis of 2."""
    result = np.empty((2, *common(np.shape(first), np.shape(second))))
    result[0], result[1] = first, second
    return result


def common(*shapes: tuple[int, ...]) -> tuple[int, ...]:
    """The shape that all broadcast to."""
    distinct = {shape for shape in shapes if shape}
    if len(distinct) > 1:
        return np.broadcast_shapes(*distinct)
    return distinct.pop() if distinct else ()


def rows(
    values: Numbers, shape: tuple[int, ...], tail: int | tuple[int, ...], whole: bool = False
) -> Any:
    """Values (..., *tail) as contiguous rows (N, *tail), or (1, *tail) where all are the same.

    Args:
        values: A float, or an array that broadcasts to (*shape, *tail).
        shape: Leading axes of the state, N in all.
        tail: Trailing axes.
        whole: One row per state, even where all are the same.
    """
    tail = (tail,) if isinstance(tail, int) else tail
    if not shape and getattr(values, 'shape', None) == tail:  # one state, as most often
        return np.ascontiguousarray(values, dtype=float)[None]
    values = np.asarray(values, dtype=float)
    if values.shape == shape + tail:
        return np.ascontiguousarray(values).reshape(-1, *tail)
    if not values.ndim and not whole:
        return np.full((1, *tail), values)
    lead = values.shape[: max(values.ndim - len(tail), 0)]
    if whole or any(n != 1 for n in lead):
        lead = shape
    if values.shape != lead + tail:
        values = filled(lead + tail, values)
    return np.ascontiguousarray(values).reshape(-1, *tail)
