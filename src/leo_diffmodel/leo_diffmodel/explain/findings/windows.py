# SPDX-License-Identifier: Apache-2.0
"""The windows of validation data that errors are given on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.blocks import Blocks
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.select.search import Search
from leo_sim.model import Model

Array = np.ndarray


def validation_windows(recordings: Sequence[Recording], found: Search, model: Model) -> Windows:
    """Windows of validation data, as long as the longest horizon that fits.

    That is the longest of which there are enough, or else the shortest. They keep what was before
    them where the explained model has a memory, such as a delay that was named.
    """
    remembering = errors.has_memory(found.final.hypothesis.model(model, found.final.theta))
    problem = found.problem
    numerics, validation = problem.numerics, problem.windows.take(problem.judged)
    shortest = numerics.longer * float(validation.dt[0].sum())
    chosen = validation
    for seconds in (s for s in problem.grids.horizon_seconds if s > shortest):
        windows = held_out(recordings, found.posed.blocks, model, seconds, remembering)
        chosen = windows if windows and windows.count else chosen
        if windows and windows.count >= numerics.held_windows:
            break
    return chosen


def held_out(
    recordings: Sequence[Recording],
    blocks: Blocks,
    model: Model,
    seconds: float,
    remembering: bool = False,
) -> Windows | None:
    """Windows of so many seconds in held-out data; None where the recordings are too short.

    `remembering` as in `errors.horizon_windows`.
    """
    most = errors.most_windows(model, seconds)
    if model.robot.contacts:
        most = round(most / blocks.held_share(recordings))
    try:
        windows = errors.horizon_windows(recordings, model, seconds, most, remembering)
    except ValueError:
        return None
    return windows.take(blocks.held(windows))


def undisturbed(prediction: Prediction, times: float) -> Array:
    """Windows that do not look like a hand push, far worse predicted than all others, (W,).

    One is so many `times` as far off as its noise floor and the median window.
    """
    size = np.sqrt((prediction.error**2 / prediction.floor).mean(axis=(1, 2)))
    free = size < times * max(1.0, float(np.median(size)))
    return free if free.sum() >= free.size / 2 else np.ones_like(free)
