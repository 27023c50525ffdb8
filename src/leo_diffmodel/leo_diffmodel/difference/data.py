# SPDX-License-Identifier: Apache-2.0
"""Transitions of one control step, as the robot made them and as the model would have."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

from leo_msgs_py.errors import UserError

if TYPE_CHECKING:
    from leo_diffmodel.bags.recording import Episode, Recording
    from leo_sim.model import Model

LATE = 0.1
"""A step whose length differs from the control period by more than this share is left out."""


@dataclass(frozen=True)
class Transitions:
    """N control steps in time order: state, held input, next state measured and predicted.

    Attributes:
        q, dq: state before the step [rad, rad/s], (N, J).
        inputs: held input [V, N m or rad], (N, A).
        q_next, dq_next: measured state after it, (N, J).
        q_model, dq_model: what the model predicts for it, (N, J).
        period: length of every step [s].
    """

    q: np.ndarray
    dq: np.ndarray
    inputs: np.ndarray
    q_next: np.ndarray
    dq_next: np.ndarray
    q_model: np.ndarray
    dq_model: np.ndarray
    period: float

    def __len__(self) -> int:
        return len(self.q)

    def part(self, rows: slice | np.ndarray) -> Transitions:
        """Some of the steps."""
        arrays = {f.name: getattr(self, f.name)[rows] for f in fields(self) if f.name != 'period'}
        return replace(self, **arrays)


def transitions(
    recordings: Iterable[Recording], model: Model, limit: int | None = None
) -> Transitions:
    """The control steps of some recordings, the first `limit` of them, with the model's answer.

    Raises:
        UserError: not one step in which the motors were on and the input was held.
    """
    recordings = list(recordings)
    rows = [row for r in recordings for e in r.episodes for row in _steps(e, r.command_period)]
    if not rows:
        names = ', '.join(str(r.path) for r in recordings) or 'no bag'
        raise UserError(
            f'{names}: no control step with a held input; record the robot while it is driven'
        )
    columns = zip(*rows[:limit], strict=True)
    q, dq, inputs, q_next, dq_next = (np.array(column) for column in columns)
    period = recordings[0].command_period
    return predicted(Transitions(q, dq, inputs, q_next, dq_next, q_next, dq_next, period), model)


def predicted(steps: Transitions, model: Model) -> Transitions:
    """Steps as they were, with the predictions of `model`."""
    from leo_sim.model.batch import rollout

    q, dq = rollout(model, steps.q, steps.dq, steps.inputs[:, None, :], steps.period)
    return replace(steps, q_model=q[:, 1], dq_model=dq[:, 1])


def _steps(episode: Episode, period: float) -> Iterator[tuple[np.ndarray, ...]]:
    """Steps of one control period within which the input did not change, motors on."""
    spacing = float(np.median(np.diff(episode.t)))
    stride = max(1, round(period / spacing))
    held = _held(episode, stride) & _on_time(episode, stride, period)
    offset = max(range(stride), key=lambda o: int(held[o::stride].sum()))
    for k in np.flatnonzero(held[offset::stride]) * stride + offset:
        end = k + stride
        yield episode.q[k], episode.dq[k], episode.inputs[k], episode.q[end], episode.dq[end]


def _held(episode: Episode, stride: int) -> np.ndarray:
    steps = len(episode.t) - stride
    held = np.ones(max(steps, 0), bool)
    for shift in range(stride):
        now = slice(shift, shift + len(held))
        held &= np.all(episode.enabled[now], axis=1)
        held &= np.all(np.isclose(episode.inputs[now], episode.inputs[: len(held)]), axis=1)
    return held


def _on_time(episode: Episode, stride: int, period: float) -> np.ndarray:
    length = episode.t[stride:] - episode.t[:-stride]
    return np.abs(length - period) <= LATE * period
