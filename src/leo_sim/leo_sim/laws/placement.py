# SPDX-License-Identifier: Apache-2.0
"""Where an effect acts: some columns of arrays with the joints (or actuators) as last axis."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import common, filled

Index = slice | list[int]


class Use(NamedTuple):
    """A placed effect, ready to run: its memory key and where it acts."""

    key: str
    effect: Any
    values: Mapping[str, Any]
    at: Index


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
    return np.concatenate(
        np.broadcast_arrays(
            *(np.asarray(f, dtype=float).reshape(np.shape(f) or (1,)) for f in figures)
        ),
        axis=-1,
    )


def added(whole: Any, index: Index, part: Any) -> Any:
    """`whole` with `part` added at `index`."""
    if isinstance(index, slice) and index == slice(None):
        return whole + part
    return put(whole, index, whole[..., index] + part)
