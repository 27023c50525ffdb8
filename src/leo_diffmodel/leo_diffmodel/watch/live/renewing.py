# SPDX-License-Identifier: Apache-2.0
"""The page's state on the newest data, and the difference model's share, computed in a thread."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
import os
import sys
import threading
import time
from typing import TYPE_CHECKING

import numpy as np

from leo_diffmodel.bags.recording import assembled, Recording
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.difference.data import Transitions, transitions
from leo_diffmodel.watch.scene import Scene
from leo_diffmodel.watch.state import State
from leo_msgs_py.bag_contents import BagContents
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import refuse_other
from leo_sim.effects import Effect
from leo_sim.model import Model

if TYPE_CHECKING:
    from leo_diffmodel.difference.model import DifferenceModel

PERIOD = 1.0  # least time between two renewals [s]
REST = 3.0  # times as long as a renewal took nothing is computed after it
SLOW = 3.0  # longer between two renewals is said [s]
NICE = 10  # how far the computing stands back behind the robot


@dataclass(frozen=True)
class Share:
    """One-step errors without and with a difference model.

    They are rms over the states, in units of the spread of each state's change.
    """

    version: int
    trained_on: int
    without: float
    corrected: float

    @property
    def words(self) -> str:
        taken = 1.0 - self.corrected / self.without if self.without else 0.0
        does = f'takes {taken:.0%} of' if taken >= 0 else f'adds {-taken:.0%} to'
        figures = f'{self.without:.3g} → {self.corrected:.3g} of the change'
        name = f'difference model {self.version}, trained on {self.trained_on} steps'
        return f'{name}: {does} the one-step error ({figures})'


class Sharer:
    """Reads the weights that the graph latched last, once each time they change."""

    def __init__(self, model: Model) -> None:
        self._model, self._bytes = model, b''
        self._difference: DifferenceModel | None = None
        self._base = model

    def share(self, weights: bytes, recording: Recording) -> Share | None:
        """The share on a recording; None without weights.

        UserError: they are none, or no step of the recording was driven.
        """
        if not weights:
            return None
        if weights != self._bytes:
            self._read(weights)
        difference = self._difference
        if difference is None or difference.robot != self._model.robot.name:
            return None
        alone = transitions([recording], self._model)
        based = alone if self._base is self._model else transitions([recording], self._base)
        corrected = difference.predict(based, self._base)
        before, after = _size(alone, alone.q_model, alone.dq_model), _size(alone, *corrected)
        return Share(difference.version, difference.trained_on, before, after)

    def _read(self, weights: bytes) -> None:
        from leo_diffmodel.difference.model import from_bytes

        self._bytes, self._difference = weights, None
        difference = from_bytes(weights)
        self._base = difference.beneath(self._model)
        self._difference = difference


def _size(steps: Transitions, q: Array, dq: Array) -> float:
    """The error of predicted states, each in units of how much the state changes."""
    off = np.hstack([steps.q_next - q, steps.dq_next - dq])
    change = np.hstack([steps.q_next - steps.q, steps.dq_next - steps.dq])
    size = np.sqrt((change**2).mean(axis=0)) + 1e-12
    return float(np.sqrt(((off / size) ** 2).mean()))


@dataclass(frozen=True)
class Source:
    """How messages become a scene: what does not change while the robot runs."""

    model: Model
    mapping: TopicMap
    extra: tuple[Effect, ...] = ()
    step: float | None = None

    def scene(self, contents: BagContents) -> Scene:
        refuse_other(contents.metadata.get('leo', {}).get('robot', ''), self.model.robot)
        recording = assembled(contents, self.model.robot, self.mapping)
        return Scene.of([recording], self.model, (), self.extra, self.step)


@dataclass(frozen=True)
class News:
    """A state or why there is none, the difference model's share, what it took [s]."""

    state: State | None = None
    share: Share | None = None
    trouble: str = ''
    seconds: float = 0.0

    @property
    def words(self) -> str:
        """How often the data are taken in; '' where that is about each second."""
        every = (1 + REST) * self.seconds
        text = f'new data every {every:.0f} s: they take {self.seconds:.1f} s to compute'
        return text if every > SLOW else ''


class Renewing:
    """Computes in one thread that stands back; takes in what is ready when it is asked to.

    `contents` and `weights` give the messages of now, and the difference model as latched last.
    """

    def __init__(
        self,
        source: Source,
        state: State,
        contents: Callable[[], BagContents],
        weights: Callable[[], bytes] = bytes,
    ) -> None:
        self._source, self._state = source, state
        self._contents, self._weights = contents, weights
        self._sharer = Sharer(source.model)
        self._thread = ThreadPoolExecutor(1, initializer=_stand_back)
        self._future: Future[News] | None = None
        self._seen, self._due = 0, 0.0
        self.frozen = False
        self.news = News()

    def toggle(self) -> None:
        self.frozen = not self.frozen

    def look(self, count: int) -> bool:
        """Take in what is ready; whether there was. Then compute again where more was measured.

        `count` is the number of messages that have come so far.
        """
        if taken := self._future is not None and self._future.done():
            self._take()
        idle = self._future is None and not self.frozen
        if idle and count != self._seen and time.monotonic() >= self._due:
            self._seen = count
            self._future = self._thread.submit(self._renewed, self._contents())
        return taken

    def end(self) -> None:
        self._thread.shutdown(wait=True, cancel_futures=True)

    def _take(self) -> None:
        assert self._future is not None
        self.news, self._future = self._future.result(), None
        self._due = time.monotonic() + max(PERIOD - self.news.seconds, REST * self.news.seconds)
        if self.news.state is not None and not self.frozen:
            self._state.become(self.news.state)
            if not self._state.player.playing:
                self._state.go(self._state.player.length)

    def _renewed(self, contents: BagContents) -> News:
        began = time.perf_counter()
        try:
            state = self._state.on(self._source.scene(contents))
            share = self._sharer.share(self._weights(), state.scene.recordings[0])
        except (UserError, ValueError, np.linalg.LinAlgError) as error:
            return News(trouble=f'not shown: {error}', seconds=time.perf_counter() - began)
        return News(state, share, seconds=time.perf_counter() - began)


def _stand_back() -> None:
    """Give this thread, and those that it starts, less of the processors than the robot has."""
    if sys.platform.startswith('linux'):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICE)
