# SPDX-License-Identifier: Apache-2.0
"""Broadcasting in the inner loop: NumPy's own functions cost more there than the copy."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Numbers = float | Array  # a float, or an array that broadcasts with the others
Index = slice | list[int]  # some of the joints (or actuators), which are the last axis of an array


def filled(shape: tuple[int, ...], values: Numbers) -> Any:
    result = np.empty(shape)
    result[...] = values
    return result


def paired(first: Numbers, second: Numbers) -> Any:
    """Both side by side along a new first axis of 2."""
    result = np.empty((2, *common(np.shape(first), np.shape(second))))
    result[0], result[1] = first, second
    return result


def common(*shapes: tuple[int, ...]) -> tuple[int, ...]:
    distinct = {shape for shape in shapes if shape}
    if len(distinct) > 1:
        return np.broadcast_shapes(*distinct)
    return distinct.pop() if distinct else ()


def rows(
    values: Numbers, shape: tuple[int, ...], tail: int | tuple[int, ...], whole: bool = False
) -> Any:
    """Values (..., *tail) as contiguous rows (N, *tail), or (1, *tail) where all are the same.

    They broadcast to (*shape, *tail), where `shape` holds N states; `whole`: a row for each.
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


def index_of(places: tuple[int, ...], count: int) -> Index:
    """A slice where possible: it costs no copy."""
    if places == tuple(range(count)):
        return slice(None)
    if not places:
        return slice(0, 0)
    if places == tuple(range(places[0], places[0] + len(places))):
        return slice(places[0], places[0] + len(places))
    return list(places)


def put(whole: Any, index: Index, part: Any) -> Any:
    """A copy of `whole` with `part` in place; `part` may have more leading axes."""
    if isinstance(index, slice) and index == slice(None):
        return part
    shape = common(np.shape(whole)[:-1], np.shape(part)[:-1])
    result = filled((*shape, np.shape(whole)[-1]), whole)
    result[..., index] = part
    return result


def stacked(figures: Sequence[Any]) -> Any:
    """Floats or arrays (S, 1, 1) side by side along the last axis."""
    if not figures:
        return np.zeros(0)
    arrays = (np.asarray(f, dtype=float).reshape(np.shape(f) or (1,)) for f in figures)
    return np.concatenate(np.broadcast_arrays(*arrays), axis=-1)


def added(whole: Any, index: Index, part: Any) -> Any:
    if isinstance(index, slice) and index == slice(None):
        return whole + part
    return put(whole, index, whole[..., index] + part)


def cut(figures: Any, index: Index) -> Any:
    """A named tuple of figures, its arrays cut to some joints."""
    return type(figures)(*(f[..., index] if np.ndim(f) else f for f in figures))
