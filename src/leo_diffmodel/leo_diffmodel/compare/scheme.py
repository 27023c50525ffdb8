# SPDX-License-Identifier: Apache-2.0
"""How finely a robot on the ground is integrated: as finely as its data can tell, and no finer."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.compare.noise import spread_out
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Windows
from leo_sim.model import Model

SCHEMES = ('search', 'training')
WINDOWS = 30
TYPICAL, RARE = 0.05, 0.08


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
