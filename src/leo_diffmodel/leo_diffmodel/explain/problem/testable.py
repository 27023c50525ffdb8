# SPDX-License-Identifier: Apache-2.0
"""Whether data can test a model at all."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.compare.noise import per_window
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.settings import SETTINGS


def untestable(windows: Windows, sigma: np.ndarray) -> str | None:
    """Why the data cannot say anything, and what to record instead; None where they can."""
    if windows.count < SETTINGS.fewest_windows:
        seconds = float(windows.dt.sum())
        return (
            f'only {seconds:.1f} s of data in {windows.count} windows: '
            'record 20 s or more with a changing input'
        )
    joints = windows.q.shape[-1]
    noise = per_window(sigma, windows)[:, 0]
    swing = np.ptp(windows.q, axis=1) / noise[:, :joints]
    speed = np.ptp(windows.dq, axis=1) / noise[:, joints:]
    moving = np.maximum(swing, speed).max(axis=-1) > SETTINGS.least_motion
    if moving.sum() < SETTINGS.fewest_windows:
        return (
            f'the robot hardly moves ({moving.sum()} of {windows.count} windows above the noise): '
            'record 20 s with an input that swings it, such as steps of random size'
        )
    return None
