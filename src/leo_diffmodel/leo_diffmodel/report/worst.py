# SPDX-License-Identifier: Apache-2.0
"""The stretches that a model predicts worst, far enough apart to be different events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.errors import horizon_windows, predict_windows, Prediction
from leo_diffmodel.compare.windows import Array

if TYPE_CHECKING:
    from leo_diffmodel.explain.select.search import Search

SECONDS = 1.0
MOST_WINDOWS = 100
SHOWN = 4


@dataclass(frozen=True)
class Stretch:
    bag: int  # index of its recording
    joint: int  # index of the joint that is off most
    time: Array  # since the bag's begin [s], shape (K+1,)
    measured: Array  # angle of that joint, shape (K+1,)
    predicted: Array  # that angle by each model, shape (M, K+1)
    band: Array  # standard deviation from noise alone about the last model, shape (K+1,)
    motion: Array  # all angles as measured, then as each model predicts, shape (1 + M, K+1, J)


def stretches(predictions: Sequence[Prediction]) -> list[Stretch]:
    """The four worst windows of the first model, of windows that all predict; none overlap."""
    first = predictions[0]
    joints = first.windows.q.shape[-1]
    excess = ((first.error**2) / first.floor)[:, : _samples(first), :joints].mean(axis=1)
    return [
        _stretch(predictions, int(w), int(np.argmax(excess[w])))
        for w in _apart(first, np.argsort(-excess.max(axis=1)))
    ]


def before_and_after(recordings: Recordings, found: Search) -> list[Prediction]:
    """Windows of a second as the model without and with the supported effects predicts them."""
    base, sigma = found.problem.base, found.problem.sigma
    fits = [found.null, found.final] if found.final.hypothesis.candidates else [found.null]
    models = [f.hypothesis.model(base, f.theta) for f in fits]
    longest = max(e.t[-1] - e.t[0] for r in recordings for e in r.episodes)
    windows = horizon_windows(recordings, models[-1], min(SECONDS, 0.4 * longest), MOST_WINDOWS)
    return [predict_windows(model, windows, sigma) for model in models]


def _samples(prediction: Prediction) -> int:
    """How many samples of a window lie within the first second."""
    elapsed = np.cumsum(prediction.windows.dt, axis=1).mean(axis=0)
    return 1 + max(1, int((elapsed <= 1.001 * SECONDS).sum()))


def _apart(prediction: Prediction, order: Array) -> list[int]:
    windows = prediction.windows
    length = windows.dt[:, : _samples(prediction) - 1].sum(axis=1)
    chosen: list[int] = []
    for w in order:
        others = [c for c in chosen if windows.source[c] == windows.source[w]]
        starts = windows.start
        if not any(abs(starts[c] - starts[w]) < max(length[c], length[w]) for c in others):
            chosen.append(int(w))
        if len(chosen) == SHOWN:
            break
    return chosen


def _stretch(predictions: Sequence[Prediction], w: int, joint: int) -> Stretch:
    windows, last = predictions[0].windows, predictions[-1]
    count, joints = _samples(last), windows.q.shape[-1]
    elapsed = np.concatenate([[0.0], np.cumsum(windows.dt[w])])[:count]
    models = [p.predicted[w, :count] for p in predictions]
    return Stretch(
        bag=int(windows.source[w]),
        joint=joint,
        time=windows.start[w] + elapsed,
        measured=windows.q[w, :count, joint],
        predicted=np.stack([states[:, joint] for states in models]),
        band=np.sqrt(last.floor[w, :count, joint]),
        motion=np.stack([windows.q[w, :count], *(states[:, :joints] for states in models)]),
    )
