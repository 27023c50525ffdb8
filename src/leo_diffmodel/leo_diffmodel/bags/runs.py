# SPDX-License-Identifier: Apache-2.0
"""Inputs brought to the states of the same run: stamps start again when a robot restarts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .inputs import InputLog
from .states import Floats, Stamps, StateLog


@dataclass(frozen=True)
class Held:
    """Held inputs by run; a run lasts until stamps jump back.

    Attributes:
        run: number of the run of each state, shape (T,).
        inputs: per run (stamps [ns] (N,), values (N, A), enabled (N, A)), stamps increasing.
    """

    run: Stamps
    inputs: tuple[tuple[Stamps, Floats, Floats], ...]

    def near(self, part: slice) -> tuple[Stamps, Floats, Floats]:
        """Return the inputs of the run that a stretch of states belongs to."""
        return self.inputs[int(self.run[part.start])]

    def unknown(self, part: slice, stamp_ns: Stamps) -> int:
        """Return how many states at the start of a stretch come before any input."""
        stamps = self.near(part)[0]
        if not stamps.size:
            return part.stop - part.start
        return int(np.searchsorted(stamp_ns[part], stamps[0]))


def split_runs(states: StateLog, inputs: InputLog, previous: bool) -> Held:
    """Pair inputs with states run by run.

    Args:
        states: joint states in log order.
        inputs: inputs in log order.
        previous: a stamp ends the period in which its input acted, instead of starting it.
    """
    run = _runs(states.stamp_ns)
    input_run = _runs(inputs.stamp_ns)
    if input_run[-1] != run[-1]:
        starts = states.log_ns[np.flatnonzero(np.diff(run)) + 1]
        input_run = np.searchsorted(starts, inputs.log_ns, side='right')
    parts = (_part(inputs, input_run == k, previous) for k in range(int(run[-1]) + 1))
    return Held(run, tuple(parts))


def _runs(stamps: Stamps) -> Stamps:
    return np.concatenate([[0], np.cumsum(np.diff(stamps) < 0)]).astype(np.int64)


def _part(inputs: InputLog, rows: np.ndarray, previous: bool) -> tuple[Stamps, Floats, Floats]:
    stamps, values, enabled = inputs.stamp_ns[rows], inputs.values[rows], inputs.enabled[rows]
    order = np.argsort(stamps, kind='stable')
    stamps, values, enabled = stamps[order], values[order], enabled[order]
    if previous:
        return stamps[:-1], values[1:], enabled[1:]
    last = np.concatenate([np.diff(stamps) > 0, np.ones(min(len(stamps), 1), dtype=bool)])
    return stamps[last], values[last], enabled[last]
