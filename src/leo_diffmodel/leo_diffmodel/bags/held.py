# SPDX-License-Identifier: Apache-2.0
"""Inputs that hold from stamp to stamp: their means over steps, and which go with which states."""

from collections.abc import Sequence

import numpy as np

from .inputs import InputLog
from .states import StateLog
from .types import Floats, Stamps


def average(t: Stamps, stamps: Stamps, values: Floats) -> Floats:
    """Return the mean of a held signal over each step.

    Stamps of states t [ns] (T,) and inputs [ns] (N,) increase, t[0] >= stamps[0]; `values[i]` (N,
    A) holds from `stamps[i]` to the next, the last one for ever. Row k of the result (T, A) is the
    mean over [t[k], t[k + 1]], exactly the held value where no stamp lies inside; the last row is
    the value held at t[-1].
    """
    first = np.searchsorted(stamps, t, side='right') - 1
    held = values[first]
    last = np.searchsorted(stamps, t[1:], side='left') - 1
    mixed = np.flatnonzero(last > first[:-1])
    if mixed.size:
        steps = np.diff(stamps)[:, None] * values[:-1]
        before = np.vstack([np.zeros((1, values.shape[1])), np.cumsum(steps, axis=0)])
        area = before[first] + (t - stamps[first])[:, None] * held  # since stamps[0], unit x ns
        held[mixed] = (area[mixed + 1] - area[mixed]) / (t[mixed + 1] - t[mixed])[:, None]
    return held


def mean_held(t: Floats, held: Floats, nodes: Floats) -> Floats:
    """Means between nodes (N + 1,) of what is held from t on, before it the first row, (N, A)."""
    area = np.vstack([np.zeros(held.shape[1]), np.cumsum(held[:-1] * np.diff(t)[:, None], axis=0)])
    until = np.minimum(nodes - t[0], 0.0)[:, None] * held[0]
    for column, since in zip(until.T, area.T, strict=True):
        column += np.interp(nodes, t, since)
    return np.asarray(np.diff(until, axis=0) / np.diff(nodes)[:, None])


Held = tuple[Stamps, Floats, Floats]  # stamps [ns] that increase (N,); values, enabled (N, A)


def held_inputs(
    states: StateLog, inputs: InputLog | None, parts: Sequence[slice], previous: bool
) -> Sequence[Held | None]:
    """Return the inputs of each stretch's run, until stamps jump back; None of a passive bag.

    With `previous` a stamp ends the period in which its input acted, instead of starting it.
    """
    if inputs is None:
        return [None] * len(parts)
    run = _runs(states.stamp_ns)
    input_run = _runs(inputs.stamp_ns)
    if input_run[-1] != run[-1]:
        starts = states.log_ns[np.flatnonzero(np.diff(run)) + 1]
        input_run = np.searchsorted(starts, inputs.log_ns, side='right')
    held = [_held(inputs, input_run == k, previous) for k in range(int(run[-1]) + 1)]
    return [held[run[part.start]] for part in parts]


def _runs(stamps: Stamps) -> Stamps:
    return np.concatenate([[0], np.cumsum(np.diff(stamps) < 0)]).astype(np.int64)


def _held(inputs: InputLog, rows: np.ndarray, previous: bool) -> Held:
    at = np.flatnonzero(rows)
    at = at[np.argsort(inputs.stamp_ns[at], kind='stable')]
    stamps, values, enabled = inputs.stamp_ns[at], inputs.values[at], inputs.enabled[at]
    if previous:
        return stamps[:-1], values[1:], enabled[1:]
    last = np.concatenate([np.diff(stamps) > 0, np.ones(min(len(stamps), 1), dtype=bool)])
    return stamps[last], values[last], enabled[last]
