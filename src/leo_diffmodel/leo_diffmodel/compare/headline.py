# SPDX-License-Identifier: Apache-2.0
"""The one error of each state that an answer is told with: which figure, and how far ahead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction
from leo_sim.description.robot import Robot

NEARLY = 0.95
Figures = dict[str, list[float]]
"""rmse and median of each state, as in explain.json."""


@dataclass(frozen=True)
class Headline:
    """Errors as an answer tells them.

    Attributes:
        statistic: rmse or median, as in explain.json.
        seconds: how far ahead of the measured start [s].
    """

    statistic: str
    seconds: float

    @property
    def words(self) -> str:
        """What is told, in words."""
        median = 'median ' if self.statistic == 'median' else ''
        return f'{median}held-out error {self.seconds:.2g} s ahead'

    @property
    def short(self) -> str:
        """What is told, in a column that is headed 'held-out error'."""
        return f'{"median" if self.statistic == "median" else "rms"}, {self.seconds:.2g} s ahead'

    def figures(self, prediction: Prediction) -> Figures:
        """Both figures of each state."""
        return {
            'rmse': errors.ahead(prediction, self.seconds),
            'median': errors.median_ahead(prediction, self.seconds),
        }

    def floor(self, prediction: Prediction) -> Figures:
        """Both figures of the errors that a perfect model would make."""
        return {
            'rmse': errors.floor_ahead(prediction, self.seconds),
            'median': errors.median_floor_ahead(prediction, self.seconds),
        }

    def mean(self, figures: Figures) -> float:
        """The mean over the states of the figure that is told."""
        return float(np.mean(figures[self.statistic]))

    def by_unit(self, figures: Figures, units: Sequence[str]) -> dict[str, float]:
        """Over the states of each unit, the root of the mean square of their figures."""
        told = np.array(figures[self.statistic])
        mine = {unit: np.array([u == unit for u in units]) for unit in dict.fromkeys(units)}
        return {unit: float(np.sqrt(np.mean(told[of] ** 2))) for unit, of in mine.items()}


def headline(robot: Robot, longest: float = np.inf) -> Headline:
    """How the errors of a robot are told, on windows of a length [s].

    On the ground a foot that comes down a little early or late turns the motion after it, with
    any model: a few such windows make up the mean square there, and more of them with the time.
    """
    statistic, seconds = ('median', 0.3) if robot.contacts else ('rmse', 0.5)
    return Headline(statistic, longest if longest < NEARLY * seconds else seconds)
