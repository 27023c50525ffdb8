# SPDX-License-Identifier: Apache-2.0
"""How far a model is off half a second ahead, on logs that no fit has seen."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.referee.card import Rig
from benchmarks.rig import window_errors
import numpy as np

from leo_sim.model import Model

BLOCK = 10
"""Windows that follow each other and are drawn together: their errors are alike."""
DRAWS, SEED = 2000, 0


def held_out_errors(rig: Rig, model: Model) -> np.ndarray:
    """Rms angle error [rad or m] of each held-out window; the same windows for every model."""
    errors = window_errors(model, rig.held_out, rig.card.seconds, rig.card.moving)
    return np.nan_to_num(errors, nan=np.inf)


def ratio(errors: np.ndarray, other: np.ndarray) -> tuple[float, float, float]:
    """How many times another's median error one is, and its 95 % interval, in pairs by window.

    Windows overlap in time, so blocks of them are drawn.
    """
    blocks = np.array_split(np.arange(len(errors)), max(2, len(errors) // BLOCK))
    rng = np.random.default_rng(SEED)
    drawn = [
        np.concatenate([blocks[i] for i in rng.integers(len(blocks), size=len(blocks))])
        for _ in range(DRAWS)
    ]
    ratios = [np.median(errors[rows]) / np.median(other[rows]) for rows in drawn]
    low, high = np.quantile(ratios, (0.025, 0.975))
    return float(np.median(errors) / np.median(other)), float(low), float(high)


def judged(right: Sequence[Sequence[str]], allowed: Sequence[str], named: Sequence[str]) -> dict:
    """What of the expected is missing in what was named, and what is one too many."""
    expected = {label for same in right for label in same} | {*allowed}
    return {
        'missing': [same[0] for same in right if not {*same} & {*named}],
        'strange': [label for label in named if label not in expected],
    }
