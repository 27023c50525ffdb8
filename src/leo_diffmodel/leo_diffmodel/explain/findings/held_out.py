# SPDX-License-Identifier: Apache-2.0
"""Held-out windows as fitted hypotheses predict them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.compare.headline import Figures, Headline, headline
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.estimate.finish import completed
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.findings.windows import undisturbed
from leo_diffmodel.explain.problem.problem import Problem
from leo_sim.description.robot import Constant
from leo_sim.model import Model

Array = np.ndarray
Values = tuple[tuple[str, ...], bytes]


@dataclass(frozen=True)
class HeldOut:
    """Windows that no fit was made on, from their measured start.

    Attributes:
        problem: what the hypotheses were fitted to.
        windows: the held-out windows.
        own: constants that held-out recordings have of their own.
    """

    problem: Problem
    base: Model
    windows: Windows
    own: tuple[Constant, ...] = ()
    _made: dict[Values, Prediction] = field(default_factory=dict, init=False, repr=False)
    _figures: dict[Values, Figures] = field(default_factory=dict, init=False, repr=False)

    @property
    def headline(self) -> Headline:
        """Which figure an answer is told with."""
        return headline(self.base.robot, float(np.median(self.windows.dt.sum(axis=1))))

    def model(self, fitted: Fit) -> Model:
        """The model as given with a fitted hypothesis, constants of held-out recordings too."""
        fitted = completed(self.problem, fitted, self.own)
        return fitted.hypothesis.model(self.base, fitted.theta)

    def predict(self, fitted: Fit) -> Prediction:
        """What a fitted hypothesis predicts, and the error of a perfect model."""
        values = _values(fitted)
        if values not in self._made:
            model, sigma = self.model(fitted), self.problem.sigma
            self._made[values] = errors.predict_windows(model, self.windows, sigma)
        return self._made[values]

    def figures(self, fitted: Fit) -> Figures:
        """Errors of a fitted hypothesis as they are told."""
        values = _values(fitted)
        if values not in self._figures:
            prediction = self._made.get(values) or self._without_floor(fitted)
            self._figures[values] = self.headline.figures(prediction)
        return self._figures[values]

    def ahead(self, fitted: Fit) -> Array:
        """Errors as far ahead as they are told, (W, 2J)."""
        made = self._made.get(_values(fitted)) or self._without_floor(fitted)
        return errors.errors_ahead(made, self.headline.seconds)

    def undisturbed(self, fitted: Fit) -> HeldOut:
        """The windows that hold no hand push, by the hypothesis that knows most."""
        free = undisturbed(self.predict(fitted), self.problem.numerics.push_times)
        rest = replace(self, windows=self.windows.take(free))
        rest._made[_values(fitted)] = self.predict(fitted).take(free)
        return rest

    def _without_floor(self, fitted: Fit) -> Prediction:
        """One prediction a window instead of 1 + 2J."""
        states = predict(self.model(fitted), self.windows, self.windows.measured[:, 0])
        return Prediction(self.windows, states, np.zeros_like(states))


def _values(fitted: Fit) -> Values:
    return tuple(c.label for c in fitted.hypothesis.candidates), fitted.theta.tobytes()
