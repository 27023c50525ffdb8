# SPDX-License-Identifier: Apache-2.0
"""What a hypothesis is off by far ahead."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.pose import Posed

Array = np.ndarray


class FarAhead:
    """What both estimators say of what they were given; see `Estimator`."""

    posed: Posed
    _floor: Array | None = None

    @property
    def most_nats(self) -> float:
        """What a window may say, see `Estimator`."""
        return self.posed.problem.gates.window_nats

    def ends(self, at: Estimate) -> Array:
        """Errors at the ends of the longest windows there are, from their measured start, (V, 2J).

        In noise floors, which are found once.
        """
        if self._floor is None:
            self._floor = _end_floor(at.posed)
        problem = at.posed.longer or at.problem
        windows, model = problem.windows, at.fit.hypothesis.model(problem.base, at.fit.theta)
        states = shooting.predict(model, windows, windows.measured[:, 0])[:, -1]
        return np.asarray((states - windows.measured[:, -1]) / self._floor)


def _end_floor(posed: Posed) -> Array:
    """Error that the noise of the start makes there with the model as given, median, (2J,)."""
    problem = posed.longer or posed.problem
    made = errors.predict_windows(problem.base, problem.windows, posed.problem.sigma)
    return np.asarray(np.sqrt(np.median(made.floor[:, -1], axis=0)))
