# SPDX-License-Identifier: Apache-2.0
"""How finely predictions are integrated: as finely as their errors can tell, and no finer."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.compare.noise import per_window, spread_out
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Windows
from leo_sim.model import Model

Array = np.ndarray
LONGEST = 5e-3
"""s; what an integration step may be at most."""
WINDOWS = 16
SHARE = 0.05
"""Of the error of a prediction: as much again, to any side, changes it by a thousandth."""


def stepped(model: Model, windows: Windows, sigma: Array) -> Model:
    """The model with the longest integration step that changes no prediction worth the name.

    Rms over windows, a prediction may change by a twentieth of its error, or of the noise of the
    reading, in every state at every instant. Where it is off by more than the state moves, it
    predicts nothing, and may change. On the ground a model keeps its step; see
    `scheme.fast_enough`.

    Args:
        model: the model as given.
        windows: those to be predicted.
        sigma: noise of each recording and channel, shape (R, 2J).
    """
    if model.robot.contacts or model.integration_step >= LONGEST:
        return model
    some = spread_out(windows, WINDOWS)
    exact = predict(model, some, some.measured[:, 0])
    error, swing = _rms(some.measured - exact), some.measured.std(axis=(0, 1))
    most = SHARE * np.maximum(error, _rms(per_window(sigma, some)))
    most = np.where(error < swing, most, np.inf)
    step = LONGEST
    while step > model.integration_step:
        coarse = model.changed(integration_step=step)
        if (_rms(predict(coarse, some, some.measured[:, 0]) - exact) <= most).all():
            return coarse
        step *= 0.5
    return model


def _rms(states: Array) -> Array:
    return np.asarray(np.sqrt((states**2).mean(axis=0)))
