# SPDX-License-Identifier: Apache-2.0
"""What a hypothesis predicts far ahead."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.explain.estimate import shooting
from leo_diffmodel.explain.estimate.estimator import Estimate

Array = np.ndarray


def predicted_ends(at: Estimate) -> Array:
    """States at the ends of the longest windows there are, from their measured start, (V, 2J).

    In units of what residuals are weighed by.
    """
    problem = at.posed.longer or at.problem
    windows, model = problem.windows, at.fit.hypothesis.model(problem.base, at.fit.theta)
    states = shooting.predict(model, windows, windows.measured[:, 0])[:, -1]
    return np.asarray(states / at.problem.weight[windows.source])
