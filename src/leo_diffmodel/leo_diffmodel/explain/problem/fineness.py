# SPDX-License-Identifier: Apache-2.0
"""How finely a search integrates: as finely as the noise of the data asks, and no finer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.settings import Numerics
from leo_sim.model import Model

Array = np.ndarray


def stepped(model: Model, windows: Windows, sigma: Array, numerics: Numerics) -> Model:
    """The model with the longest integration step that this data cannot tell from a finer one.

    The step is halved until that changes the predictions of all windows by less than `finer_nats`.

    Args:
        model: the model as given.
        windows: the data.
        sigma: noise of each recording and channel, shape (R, 2J).
        numerics: the longest and the finest step, and what a finer one must change.
    """
    if model.robot.contacts:
        return model
    least, start = numerics.finest_step * model.integration_step, windows.measured[:, 0]
    coarse = model.changed(integration_step=max(numerics.longest_step, least))
    linear = shooting.linearise(coarse, windows, sigma, numerics, Hypothesis(), np.zeros(0), start)
    before = linear.residual
    while (step := 0.5 * coarse.integration_step) >= least:
        fine = model.changed(integration_step=step)
        predicted = shooting.predict(fine, windows, start)
        after = shooting.whiten(windows, predicted, sigma, numerics.farthest)
        moved = shooting.eliminate(replace(linear, residual=before - after))[0]
        if 0.5 * float((moved**2).sum()) < numerics.finer_nats:
            break
        coarse, before = fine, after
    return coarse
