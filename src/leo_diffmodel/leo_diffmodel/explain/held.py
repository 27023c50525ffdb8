# SPDX-License-Identifier: Apache-2.0
"""The windows that held-out errors are given on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.engine import Search
from leo_sim.model import Model

HORIZON_SECONDS = 1.0
PUSH_SIGMAS = 6.0
PUSH_TIMES = 6.0


def held_windows(recordings: Sequence[Recording], found: Search, model: Model) -> Windows:
    """Windows of the data no fit has seen, as long as the longest horizon that fits."""
    held = found.problem.windows.take(~found.problem.train)
    seconds = HORIZON_SECONDS
    while seconds > float(held.dt[0].sum()):
        windows = _windows_of(recordings, model, seconds)
        mask = found.posed.blocks.held(windows) if windows else np.zeros(0, dtype=bool)
        if windows and mask.any():
            return _undisturbed(windows.take(mask), found)
        seconds /= 2
    return held


def _windows_of(
    recordings: Sequence[Recording], model: Model, seconds: float
) -> Windows | None:
    try:
        return errors.horizon_windows(recordings, model, seconds)
    except ValueError:
        return None


def _undisturbed(windows: Windows, found: Search) -> Windows:
    """Without windows that look like a hand push: far worse predicted than all the others."""
    model = found.final.hypothesis.model(found.problem.base, found.final.theta)
    prediction = errors.predict_windows(model, windows, found.problem.sigma)
    size = np.sqrt((prediction.error**2 / prediction.floor).mean(axis=(1, 2)))
    calm = size < max(PUSH_SIGMAS, PUSH_TIMES * float(np.median(size)))
    return windows.take(calm) if calm.sum() >= calm.size / 2 else windows
