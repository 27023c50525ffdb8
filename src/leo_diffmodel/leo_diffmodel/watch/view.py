# SPDX-License-Identifier: Apache-2.0
"""A view as plain values, which another process can draw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.watch.curves import Columns
from leo_diffmodel.watch.stage import Stage

Array = np.ndarray


@dataclass(frozen=True)
class View:
    """What is drawn.

    Attributes:
        title: the robot and its data.
        error: as given and now, in words.
        switched: what is switched on, a line each.
        unit: the state whose error is shown, with its unit.
        seconds: how far ahead the ghosts are predicted [s].
        stage: draws poses.
        times: of the pictures on the timeline [s], shape (F,).
        places: the same as bag and bag time.
        poses: joint angles as given, with the switches, as measured, shape (F, 3, J).
        horizon, time, worst: `against_horizon`, `over_time` and `worst` of `curves`.
        held: `held` of `curves`.
    """

    title: str
    error: str
    switched: tuple[str, ...]
    unit: str
    seconds: float
    stage: Stage
    times: Array
    places: tuple[str, ...]
    poses: Array
    horizon: Columns
    time: Columns
    worst: Columns
    held: Array
