# SPDX-License-Identifier: Apache-2.0
"""How finely predictions are integrated: as finely as their errors can tell, and no finer.

On the ground that is a choice among the schemes of the robot, elsewhere one of the step.
"""

from __future__ import annotations

import numpy as np

from leo_diffmodel.compare.noise import per_window, spread_out
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Windows
from leo_sim.model import Model

Array = np.ndarray
SCHEMES = ('search', 'training')
WINDOWS = 30
TYPICAL, RARE = 0.05, 0.08
LONGEST = 5e-3
"""s; what an integration step may be at most."""
STEPPED = 16
"""Windows by which a step is chosen."""
SHARE = 0.05
"""Of the error of a prediction: as much again, to any side, changes it by a thousandth."""


def fast_enough(model: Model, windows: Windows) -> Model:
    """The model with the coarsest of its schemes that these windows cannot tell from its own.

    They cannot where the typical difference is a small part of what the model is off by anyway,
    and hardly any is larger than that: a landing foot is some rad/s apart now and then in any
    two schemes.

    Args:
        model: the model as given.
        windows: short windows of the data.
    """
    if not model.robot.contacts or model.scheme != 'reference':
        return model
    some = spread_out(windows, WINDOWS)
    start = some.measured[:, 0]
    fine = predict(model, some, start)[:, -1]
    off = np.sqrt(np.median((some.measured[:, -1] - fine) ** 2, axis=0)) + 1e-12
    for scheme in SCHEMES:
        coarse = model.changed(scheme=scheme)
        apart = np.abs(predict(coarse, some, start)[:, -1] - fine) / off
        if np.median(apart) < TYPICAL and (apart > 1.0).mean() < RARE:
            return coarse
    return model


def stepped(model: Model, windows: Windows, sigma: Array) -> Model:
    """The model with the longest integration step that changes no prediction worth the name.

    Rms over windows, a prediction may change by a twentieth of its error, or of the noise of the
    reading, in every state at every instant. Where it is off by more than the state moves, it
    predicts nothing, and may change. On the ground a model keeps its step; see
    `fast_enough`.

    Args:
        model: the model as given.
        windows: those to be predicted.
        sigma: noise of each recording and channel, shape (R, 2J).
    """
    if model.robot.contacts or model.integration_step >= LONGEST:
        return model
    some = spread_out(windows, STEPPED)
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
