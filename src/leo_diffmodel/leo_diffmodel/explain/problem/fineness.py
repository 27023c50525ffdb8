# SPDX-License-Identifier: Apache-2.0
"""How finely a search integrates: as finely as the noise of the data asks, and no finer.

Sensitivities need less: what a step is off by is nearly the same with and without a small change.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.settings import Numerics
from leo_sim.model import Model

Array = np.ndarray


def stepped(
    model: Model, windows: Windows, sigma: Array, numerics: Numerics
) -> tuple[Model, float | None]:
    """The model with the longest integration step that this data cannot tell from a finer one.

    The step is halved until that changes the predictions of all windows by less than `finer_nats`.

    Args:
        model: the model as given.
        windows: the data.
        sigma: noise of each recording and channel, shape (R, 2J).
        numerics: the longest and the finest step, and what a finer one must change.

    Returns:
        the model, and the longest step [s] that finds the sensitivity to the start states; None
        is its own.
    """
    least = numerics.finest_step * model.integration_step
    if numerics.longest_step <= least:
        return model, None
    coarse = model.changed(integration_step=numerics.longest_step)
    tried = [_linearised(coarse, windows, sigma, numerics)]
    steps = [coarse.integration_step]
    while 0.5 * steps[-1] >= least:
        fine = model.changed(integration_step=0.5 * steps[-1])
        after = _linearised(fine, windows, sigma, numerics)
        difference = replace(tried[-1], residual=tried[-1].residual - after.residual)
        moved = shooting.eliminate(difference)[0]
        if 0.5 * float((moved**2).sum()) < numerics.finer_nats:
            break
        coarse = fine
        tried.append(after)
        steps.append(fine.integration_step)
    alike = [_apart(linear, tried[-1]) < numerics.rough for linear in tried]
    return coarse, steps[alike.index(True)]


def _linearised(
    model: Model, windows: Windows, sigma: Array, numerics: Numerics
) -> shooting.Linear:
    return shooting.linearise(
        model, windows, sigma, numerics, Hypothesis(), np.zeros(0), windows.measured[:, 0]
    )


def _apart(rough: shooting.Linear, fine: shooting.Linear) -> float:
    """By how much the sensitivity of most windows to their start differs, as a share of it."""
    change = np.linalg.norm(rough.by_start - fine.by_start, axis=(1, 2))
    size = np.linalg.norm(fine.by_start, axis=(1, 2))
    return float(np.median(change / np.maximum(size, 1e-12)))
