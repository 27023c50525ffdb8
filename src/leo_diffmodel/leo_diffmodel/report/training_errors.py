# SPDX-License-Identifier: Apache-2.0
"""Errors on the training data, to put beside those on the validation data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.errors import horizon_table, horizon_windows, Prediction
from leo_diffmodel.explain.problem.shooting import predict
from leo_diffmodel.explain.select.search import Search

MOST_WINDOWS = 100


def training_errors(
    recordings: Sequence[Recording], found: Search, seconds: float, step: float
) -> list[dict]:
    """Rows {steps, before, after} of rms errors against horizon on training data.

    Args:
        recordings: all bags, in the order of the search.
        found: the finished search.
        seconds: the longest horizon.
        step: one control period [s].
    """
    base, blocks = found.problem.base, found.posed.blocks
    models = [fit.hypothesis.model(base, fit.theta) for fit in (found.null, found.final)]
    try:
        windows = horizon_windows(recordings, models[1], seconds, 4 * MOST_WINDOWS)
    except ValueError:
        return []
    train = np.flatnonzero(blocks.train(windows))
    if not train.size:
        return []
    windows = windows.take(train[:: -(-train.size // MOST_WINDOWS)])
    start, none = windows.measured[:, 0], np.zeros_like(windows.measured)
    predictions = [Prediction(windows, predict(m, windows, start), none) for m in models]
    tables = [horizon_table(p, step) for p in predictions]
    return [
        {'steps': b['steps'], 'before': b['rmse'], 'after': a['rmse']}
        for b, a in zip(*tables, strict=True)
    ]
