# SPDX-License-Identifier: Apache-2.0
"""Held-out windows, and how fitted hypotheses predict them."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.blocks import Blocks
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.compare.headline import Figures, Headline, headline
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Array, Windows
from leo_diffmodel.explain.estimate.finish import completed
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.problem.problem import Problem
from leo_sim.description.robot import Constant
from leo_sim.model import Model

Values = tuple[tuple[str, ...], bytes]


def held_out(
    recordings: Recordings, blocks: Blocks, model: Model, seconds: float, remembering: bool = False
) -> Windows | None:
    """Windows of so many seconds in held-out data; None where the recordings are too short.

    `remembering` as in `errors.horizon_windows`.
    """
    most = errors.most_windows(model, seconds)
    if model.robot.contacts:
        most = round(most / blocks.held_share(recordings))
    try:
        windows = errors.horizon_windows(recordings, model, seconds, most, remembering)
    except ValueError:
        return None
    return windows.take(blocks.held(windows))


@dataclass(frozen=True)
class HeldOut:
    """Windows that no fit was made on, predicted from their measured start."""

    problem: Problem  # that hypotheses were fitted to
    base: Model
    windows: Windows
    own: tuple[Constant, ...] = ()  # constants that held-out recordings have of their own
    _completed: dict[int, tuple[Fit, Fit]] = field(default_factory=dict, repr=False)
    _made: dict[Values, Prediction] = field(default_factory=dict, init=False, repr=False)
    _ahead: dict[Values, Array] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(
        cls,
        recordings: Recordings,
        posed: Posed,
        fitted: Fit,
        model: Model,
        own: Sequence[Constant] = (),
    ) -> 'HeldOut':
        """Windows of validation data, as long as the longest horizon of which there are enough.

        They keep what was before them where the fitted model has a memory, such as a delay.
        """
        remembering = errors.has_memory(fitted.hypothesis.model(model, fitted.theta))
        problem = posed.problem
        numerics, chosen = problem.numerics, problem.windows.take(problem.judged)
        shortest = numerics.longer * float(chosen.dt[0].sum())
        for seconds in (s for s in problem.grids.horizon_seconds if s > shortest):
            windows = held_out(recordings, posed.blocks, model, seconds, remembering)
            chosen = windows if windows and windows.count else chosen
            if windows and windows.count >= numerics.held_windows:
                break
        return cls(problem, model, chosen, tuple(own))

    @property
    def headline(self) -> Headline:
        return headline(self.base.robot, float(np.median(self.windows.dt.sum(axis=1))))

    def completed(self, fitted: Fit, problem: Problem | None = None) -> Fit:
        """The fit with the constants that held-out recordings have of their own, found once.

        `problem` is what it was fitted to, where that is another one.
        """
        if id(fitted) not in self._completed:
            done = completed(problem or self.problem, fitted, self.own)
            self._completed.update({id(f): (f, done) for f in (fitted, done)})
        return self._completed[id(fitted)][1]

    def model(self, fitted: Fit) -> Model:
        """The model as given with a fitted hypothesis, constants of held-out recordings too."""
        fitted = self.completed(fitted)
        return fitted.hypothesis.model(self.base, fitted.theta)

    def predict(self, fitted: Fit) -> Prediction:
        """What a fitted hypothesis predicts, and the error of a perfect model."""
        values = _values(fitted)
        if values not in self._made:
            model, sigma = self.model(fitted), self.problem.sigma
            self._made[values] = errors.predict_windows(model, self.windows, sigma)
        return self._made[values]

    def figures(self, fitted: Fit) -> Figures:
        return self.headline.of(self.ahead(fitted))

    def ahead(self, fitted: Fit) -> Array:
        """Errors of each window as far ahead as the headline, (W, 2J)."""
        values = _values(fitted)
        if values not in self._ahead:
            self._ahead[values] = self._without_floor(fitted).ahead(self.headline.seconds)[0]
        return self._ahead[values]

    def undisturbed(self, fitted: Fit) -> 'HeldOut':
        """The windows that hold no hand push, by the hypothesis that knows most.

        A pushed one is far worse predicted than all others: so many times as far off as its noise
        floor and the median window.
        """
        made, times = self.predict(fitted), self.problem.numerics.push_times
        size = np.sqrt((made.error**2 / made.floor).mean(axis=(1, 2)))
        free = size < times * max(1.0, float(np.median(size)))
        if free.sum() < free.size / 2:
            free = np.ones_like(free)
        rest = replace(self, windows=self.windows.take(free))
        rest._made[_values(fitted)] = made.take(free)
        return rest

    def _without_floor(self, fitted: Fit) -> Prediction:
        """The prediction as made before, else without the noise floor, which takes 2J more."""
        if made := self._made.get(_values(fitted)):
            return made
        states = predict(self.model(fitted), self.windows, self.windows.measured[:, 0])
        return Prediction(self.windows, states, np.zeros_like(states))


def _values(fitted: Fit) -> Values:
    return tuple(c.label for c in fitted.hypothesis.candidates), fitted.theta.tobytes()
