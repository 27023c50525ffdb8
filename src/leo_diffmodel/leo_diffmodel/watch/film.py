# SPDX-License-Identifier: Apache-2.0
"""The whole recording, predicted from the measured state again and again, and its player."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
import time
from typing import NamedTuple, Self

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.noise import HISTORY
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Array, cut, Windows
from leo_diffmodel.watch.scene import Timeline
from leo_sim.model import Model

WORST = 5
SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


class Frame(NamedTuple):
    """Angles of all joints at one instant [rad, m], (J,): by both models, and as measured."""

    given: Array
    repaired: Array
    measured: Array


@dataclass(frozen=True)
class Film:
    windows: Windows
    time: Array  # of each sample on the timeline [s], shape (W, K+1)
    given: Array  # states as the model as given predicts them, shape (W, K+1, 2J)
    repaired: Array  # the same with the effects that are switched on

    @classmethod
    def of(cls, recordings: Recordings, seconds: float, model: Model) -> Self:
        """Predict over so many seconds, again and again; ValueError: no episode is so long."""
        windows = cut(recordings, seconds, stride=seconds, history=HISTORY)
        elapsed = np.cumsum(windows.dt, axis=1)
        begin = Timeline.of(recordings).at(windows.source, windows.start)
        time = begin[:, None] + np.concatenate([np.zeros((windows.count, 1)), elapsed], axis=1)
        given = _predicted(model, windows)
        return cls(windows, time, given, given)

    def repaired_by(self, model: Model | None) -> Self:
        """With what another model predicts beside it; None: nothing is switched on."""
        repaired = self.given if model is None else _predicted(model, self.windows)
        return replace(self, repaired=repaired)

    def frame(self, seconds: float) -> Frame:
        w = max(0, int(np.searchsorted(self.time[:, 0], seconds, side='right')) - 1)
        k = int(np.argmin(np.abs(self.time[w] - seconds)))
        joints = self.windows.q.shape[-1]
        return Frame(self.given[w, k, :joints], self.repaired[w, k, :joints], self.windows.q[w, k])

    def error(self, states: Array, index: int) -> Array:
        """Rms error of one state over each window, shape (W,), in its unit."""
        off = (self.windows.measured - states)[..., index]
        return np.asarray(np.sqrt((off**2).mean(axis=1)))

    @cached_property
    def middle(self) -> Array:
        """Middle of each window on the timeline [s], shape (W,)."""
        return np.asarray(0.5 * (self.time[:, 0] + self.time[:, -1]))

    def worst(self, index: int) -> Array:
        return np.argsort(-self.error(self.repaired, index))[:WORST]

    def apart(self) -> Array:
        """When in each window the repaired pose is furthest from the measured one [s], (W,)."""
        off = self.repaired[..., : self.windows.q.shape[-1]] - self.windows.q
        ends_before = np.cos(off).sum(axis=-1)[:, :-1]  # at its end the next window is shown
        return np.take_along_axis(self.time, ends_before.argmin(axis=1)[:, None], 1)[:, 0]


def _predicted(model: Model, windows: Windows) -> Array:
    """States predicted from the measured start; where they run away, as large as a plot bears."""
    states = predict(model, windows, windows.measured[:, 0])
    return np.nan_to_num(states, nan=1e6, posinf=1e6, neginf=-1e6)


@dataclass
class Player:
    """A clock from 0 to `length` [s] and again, `speed` times as fast as `clock`."""

    length: float
    clock: Callable[[], float] = time.monotonic
    speed: float = 1.0
    _from: float = 0.0
    _since: float | None = None

    @property
    def playing(self) -> bool:
        return self._since is not None

    @property
    def now(self) -> float:
        if self._since is None:
            return self._from
        return (self._from + self.speed * (self.clock() - self._since)) % self.length

    def go(self, seconds: float) -> None:
        self._from = min(max(seconds, 0.0), self.length)
        self._since = self.clock() if self.playing else None

    def play(self, on: bool = True) -> None:
        self._from = self.now
        self._since = self.clock() if on else None

    def at_speed(self, speed: float) -> None:
        self.go(self.now)
        self.speed = speed
