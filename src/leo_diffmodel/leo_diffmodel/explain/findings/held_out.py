# SPDX-License-Identifier: Apache-2.0
"""What a finished search says of the validation data."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.compare.headline import Headline, headline
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.own_constants import completed
from leo_diffmodel.explain.findings.held import undisturbed
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.select.evidence import score, Scored
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.select.sets import widens
from leo_diffmodel.explain.select.stable import share
from leo_diffmodel.explain.settings import SETTINGS, Settings
from leo_sim.description.robot import Constant
from leo_sim.model import Model

Array = np.ndarray
Values = tuple[tuple[str, ...], bytes]


@dataclass(frozen=True)
class Context:
    """A finished search and the held-out windows: what doubts and rows are read from.

    Attributes:
        found: the finished search.
        base: the model as given.
        facts: what decides which effects are the same thing.
        validation: windows that no fit was made on, for the errors.
        step: one control period [s].
        settings: the gates.
        bags: names of the recordings, in the order of the windows' `source`.
        own: constants that held-out recordings have of their own.
    """

    found: Search
    base: Model
    facts: Facts
    validation: Windows
    step: float
    settings: Settings = SETTINGS
    bags: tuple[str, ...] = ()
    own: tuple[Constant, ...] = ()
    _made: dict[Values, Prediction] = field(default_factory=dict, init=False, repr=False)

    def predict(self, fitted: Fit) -> Prediction:
        """Held-out windows as the fitted hypothesis predicts them from their measured start."""
        values = _values(fitted)
        if values not in self._made:
            model, sigma = self._model(fitted), self.found.problem.sigma
            self._made[values] = errors.predict_windows(model, self.validation, sigma)
        return self._made[values]

    def without(self, candidate: Candidate) -> Scored:
        """The chosen hypothesis less one effect."""
        chosen = self.found.chosen
        if known := self.found.known(chosen.names - {candidate}):
            return known
        full = chosen.fit.hypothesis
        part = full.without(full.candidates.index(candidate))
        theta = part.carried(full, chosen.fit.theta)
        fitted = fit(chosen.at.problem, part, theta, chosen.fit.start)
        return score(Estimate(chosen.at.posed, fitted))

    def share(self, candidate: Candidate) -> float:
        """Share of the turns that hold an effect, by any name, or as part of another one."""
        return share(self.found.turns, [candidate], self.facts.alike)

    def holds(self, names: Iterable[Candidate], candidate: Candidate) -> bool:
        """Whether a set has an effect, the same thing by another name, or a wider law of it."""
        return any(self.alike(c, candidate) or widens(c, candidate) for c in names)

    def alike(self, a: Candidate, b: Candidate) -> bool:
        """Whether two effects are one, or the same thing in the data."""
        return self.facts.alike(a, b)

    def undisturbed(self, fitted: Fit) -> Context:
        """This search, read on the windows that hold no hand push."""
        free = undisturbed(self.predict(fitted))
        context = replace(self, validation=self.validation.take(free))
        context._made[_values(fitted)] = self.predict(fitted).take(free)
        return context

    def headline(self, fitted: Fit) -> float:
        """Mean held-out error over the states, as it is told."""
        return self.told.mean(self.without_floor(fitted))

    def by_unit(self, fitted: Fit) -> dict[str, float]:
        """Held-out error of each unit, as it is told."""
        units = [state['unit'] for state in errors.state_names(self.base)]
        return self.told.by_unit(self.without_floor(fitted), units)

    @property
    def told(self) -> Headline:
        """Which figure an answer is told with."""
        return headline(self.base.robot, float(np.median(self.validation.dt.sum(axis=1))))

    def without_floor(self, fitted: Fit) -> Prediction:
        """As `predict`, but with a floor of 0: one prediction a window instead of 1 + 2J."""
        if made := self._made.get(_values(fitted)):
            return made
        states = predict(self._model(fitted), self.validation, self.validation.measured[:, 0])
        return Prediction(self.validation, states, np.zeros_like(states))

    @cached_property
    def floors(self) -> list[float]:
        """What each effect does in the windows of the search that no other one can [noise floors].

        Root mean square over windows and states at their end, of the prediction from the measured
        start less that of the other effects, refitted without it.
        """
        final, problem = self.found.final, self.found.problem
        windows, start = problem.windows, problem.windows.measured[:, 0]
        made = errors.predict_windows(self._model(final), windows, problem.sigma)
        less = [self._model(self.without(c).fit) for c in final.hypothesis.candidates]
        return [errors.change_at_end(made, predict(m, windows, start)) for m in less]

    def loss(self, scored: Scored) -> Array:
        """Loss of each window, held-out recordings with what they tell of themselves, (W,)."""
        return completed(scored.at.problem, scored.fit, self.own).loss

    def _model(self, fitted: Fit) -> Model:
        fitted = completed(self.found.problem, fitted, self.own)
        return fitted.hypothesis.model(self.base, fitted.theta)


def _values(fitted: Fit) -> Values:
    return tuple(c.label for c in fitted.hypothesis.candidates), fitted.theta.tobytes()
