# SPDX-License-Identifier: Apache-2.0
"""A view as plain values, which another process can draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from leo_diffmodel.watch.stage import Stage

Array = np.ndarray
Columns = dict[str, Array]
Told = Callable[[str], None]


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

    def draw(self, path: Path, told: Told) -> str:
        """Write it as .png, .svg, .gif or .mp4, as the path ends; the name of the file.

        Raises:
            UserError: a film cannot be encoded.
        """
        from leo_diffmodel.watch.drawing import draw

        return draw(self, path, told)
