# SPDX-License-Identifier: Apache-2.0
"""The whole recording, predicted from the measured state again and again."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.watch.scene import Scene
from leo_sim.model import Model

Array = np.ndarray
WORST = 5


@dataclass(frozen=True)
class Frame:
    """One instant: angles of all joints [rad, m], shape (J,), as measured and as predicted."""

    measured: Array
    given: Array
    repaired: Array


@dataclass(frozen=True)
class Film:
    """Windows back to back.

    Attributes:
        windows: the data.
        time: of each sample on the timeline [s], shape (W, K+1).
        given: states as the model as given predicts them, shape (W, K+1, 2J).
        repaired: as the model with the effects that are switched on does.
        held: which windows lie wholly in held-out data, shape (W,).
    """

    windows: Windows
    time: Array
    given: Array
    repaired: Array
    held: Array

    @classmethod
    def of(cls, scene: Scene, seconds: float, repaired: Model) -> Film:
        """Predict from each measured state on, over so many seconds.

        Raises:
            ValueError: no episode is that long.
        """
        windows = scene.back_to_back(seconds)
        elapsed = np.cumsum(windows.dt, axis=1)
        begin = scene.timeline.at(windows.source, windows.start)
        time = begin[:, None] + np.concatenate([np.zeros((windows.count, 1)), elapsed], axis=1)
        given, held = _predicted(scene.model, windows), scene.blocks.held(windows)
        return cls(windows, time, given, _predicted(repaired, windows), held)

    def repaired_by(self, model: Model) -> Film:
        """The same windows with another repaired model."""
        again = _predicted(model, self.windows)
        return Film(self.windows, self.time, self.given, again, self.held)

    def frame(self, seconds: float) -> Frame:
        """What to draw at a time on the timeline; the nearest there is."""
        last = np.searchsorted(self.time[:, 0], seconds, side='right') - 1
        w = max(0, int(last))
        k = int(np.argmin(np.abs(self.time[w] - seconds)))
        joints = self.windows.q.shape[-1]
        return Frame(self.windows.q[w, k], self.given[w, k, :joints], self.repaired[w, k, :joints])

    def error(self, states: Array, index: int) -> Array:
        """Rms error of one state over each window, shape (W,), in its unit."""
        off = (self.windows.measured - states)[..., index]
        return np.asarray(np.sqrt((off**2).mean(axis=1)))

    @cached_property
    def middle(self) -> Array:
        """Middle of each window on the timeline [s], shape (W,)."""
        return np.asarray(0.5 * (self.time[:, 0] + self.time[:, -1]))

    def worst(self, index: int) -> Array:
        """The windows in which the repaired model is furthest off in one state, worst first."""
        return np.argsort(-self.error(self.repaired, index))[:WORST]


def _predicted(model: Model, windows: Windows) -> Array:
    """States predicted from the measured start; where they run away, as large as a plot bears."""
    states = predict(model, windows, windows.measured[:, 0])
    return np.nan_to_num(states, nan=1e6, posinf=1e6, neginf=-1e6)
