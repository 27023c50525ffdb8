# SPDX-License-Identifier: Apache-2.0
"""How far a model is off on held-out windows: the curve, and the figures that are told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.headline import Headline, headline
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.watch.scene import Scene
from leo_sim.model import Model

Array = np.ndarray


@dataclass(frozen=True)
class Score:
    """Errors of one model.

    Attributes:
        rows: against horizon: {steps, seconds, rmse, mean, noise_floor}, a figure per state.
        figures: the error of each state that is told, shape (2J,).
        floor: what a perfect model would make of it, shape (2J,).
    """

    rows: list[dict]
    figures: Array
    floor: Array

    @property
    def size(self) -> float:
        """The error as one figure: in noise floors, rms over the states."""
        return float(np.sqrt(np.mean((self.figures / self.floor) ** 2)))


def told(scene: Scene) -> Headline:
    """Which error is told: how far ahead, and whether rms or median."""
    return headline(scene.model.robot, float(np.median(scene.held.dt.sum(axis=1))))


def score(scene: Scene, model: Model) -> Score:
    """Errors of a model on the held-out windows, with the floor of its own predictions."""
    prediction = errors.predict_windows(model, scene.held, scene.sigma)
    kind = told(scene)
    return Score(
        errors.horizon_table(prediction, scene.step),
        np.array(kind.figures(prediction)[kind.statistic]),
        np.array(kind.floor(prediction)[kind.statistic]),
    )


def size(scene: Scene, model: Model, floor: Array) -> float:
    """The error of a model as one figure, in noise floors that are known, (2J,)."""
    states = predict(model, scene.held, scene.held.measured[:, 0])
    prediction = errors.Prediction(scene.held, states, np.zeros_like(states))
    kind = told(scene)
    return float(np.sqrt(np.mean((kind.figures(prediction)[kind.statistic] / floor) ** 2)))
