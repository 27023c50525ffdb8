# SPDX-License-Identifier: Apache-2.0
"""The one error of each state that an answer gives: which figure, and how far ahead."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from leo_diffmodel.compare.errors import Prediction, root_mean
from leo_diffmodel.compare.settings import COMPARE
from leo_sim.description.robot import Robot

Figures = dict[str, list[float]]  # rmse and median of each state, as in explain.json
NORMAL = ndtri(0.5 + (np.arange(64) + 0.5) / 128)
"""Sizes of a standard normal variable, each as likely as the others."""


@dataclass(frozen=True)
class Headline:
    """Errors as an answer gives them."""

    statistic: str  # rmse, or median (of the size), which a few hand pushes do not move
    seconds: float  # how far ahead of the measured start [s]

    @property
    def words(self) -> str:
        median = 'median ' if self.statistic == 'median' else ''
        return f'{median}held-out error {self.seconds:.2g} s ahead'

    @property
    def short(self) -> str:
        """What is given, in a column that is headed 'held-out error'."""
        return f'{"median" if self.statistic == "median" else "rms"}, {self.seconds:.2g} s ahead'

    def figures(self, prediction: Prediction) -> Figures:
        return self.of(prediction.ahead(self.seconds)[0])

    def of(self, error: np.ndarray) -> Figures:
        """Both figures of errors so far ahead, (W, 2J)."""
        return {'rmse': root_mean(error**2), 'median': np.median(np.abs(error), axis=0).tolist()}

    def floor(self, prediction: Prediction) -> Figures:
        """Both figures of the errors that a perfect model would make."""
        _, variance = prediction.ahead(self.seconds)
        sizes = NORMAL[:, None, None] * np.sqrt(variance)
        return {'rmse': root_mean(variance), 'median': np.median(sizes, axis=(0, 1)).tolist()}

    def mean(self, figures: Figures) -> float:
        """The mean over the states of the figure that is given."""
        return float(np.mean(figures[self.statistic]))

    def by_unit(self, figures: Figures, units: Sequence[str]) -> dict[str, float]:
        """Over the states of each unit, the root of the mean square of their figures."""
        given = np.array(figures[self.statistic])
        members = {unit: np.array([u == unit for u in units]) for unit in dict.fromkeys(units)}
        return {unit: float(np.sqrt(np.mean(given[of] ** 2))) for unit, of in members.items()}


def headline(robot: Robot, longest: float = np.inf) -> Headline:
    """How the errors of a robot are given, on windows of a length [s].

    On the ground a foot that comes down a little early or late turns the motion after it, with
    any model: a few such windows make up the mean square there, and more of them with the time.
    """
    statistic, seconds = 'rmse', COMPARE.headline
    if robot.contacts:
        statistic, seconds = 'median', COMPARE.headline_on_ground
    return Headline(statistic, longest if longest < COMPARE.nearly * seconds else seconds)
