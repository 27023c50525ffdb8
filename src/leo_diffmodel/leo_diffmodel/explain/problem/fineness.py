# SPDX-License-Identifier: Apache-2.0
"""How finely a search integrates: as finely as the noise of the data asks, and no finer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_sim.model import Model

Array = np.ndarray
LONGEST = 5e-3
"""s; with it every effect of the catalogue has been found, also friction that sticks and slips."""

ENOUGH_NATS = 0.5
FINEST = 1.0
"""Of the robot's own step: data almost without noise ask for no end of it."""


def stepped(model: Model, windows: Windows, sigma: Array) -> Model:
    """The model with the longest integration step that this data cannot tell from a finer one.

    The step is halved until that changes the predictions of all windows by less than half a nat.

    Args:
        model: the model as given.
        windows: the data.
        sigma: noise of each recording and channel, shape (R, 2J).
    """
    if model.robot.contacts:
        return model
    least, start = FINEST * model.integration_step, windows.measured[:, 0]
    coarse = model.changed(integration_step=max(LONGEST, least))
    linear = shooting.linearise(coarse, windows, sigma, Hypothesis(), np.zeros(0), start)
    before = linear.residual
    while (step := 0.5 * coarse.integration_step) >= least:
        fine = model.changed(integration_step=step)
        after = shooting.whiten(windows, shooting.predict(fine, windows, start), sigma)
        moved = shooting.eliminate(replace(linear, residual=before - after))[0]
        if 0.5 * float((moved**2).sum()) < ENOUGH_NATS:
            break
        coarse, before = fine, after
    return coarse
