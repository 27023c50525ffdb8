# SPDX-License-Identifier: Apache-2.0
"""The page's state again and again on the newest data, computed beside the page."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
import os
import sys
import threading
import time

import numpy as np

from leo_diffmodel.bags.contents import BagContents
from leo_diffmodel.bags.recording import assembled, Recording
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.watch.live.share import Share, Sharer
from leo_diffmodel.watch.scene import Scene
from leo_diffmodel.watch.state import State
from leo_msgs_py.errors import UserError
from leo_sim.effects import Effect
from leo_sim.model import Model

PERIOD = 1.0
"""Least time between two renewals [s]."""
REST = 3.0
"""Times as long as a renewal took nothing is computed after it."""
SLOW = 3.0
"""Longer between two renewals is said [s]."""
NICE = 10
"""How far the computing stands back behind the robot."""


@dataclass(frozen=True)
class Source:
    """How messages become a scene: what does not change while the robot runs."""

    model: Model
    mapping: TopicMap
    extra: tuple[Effect, ...] = ()
    step: float | None = None

    def recording(self, contents: BagContents) -> Recording:
        """The states of the messages, as `read_bag` makes them.

        Raises:
            UserError: they are not of this robot, or too few.
        """
        return assembled(contents, self.model.robot, self.mapping)

    def scene(self, contents: BagContents) -> Scene:
        """What the page shows of the messages.

        Raises:
            UserError: as `recording`, or too few for a scene.
        """
        return Scene.of([self.recording(contents)], self.model, (), self.extra, self.step)


@dataclass(frozen=True)
class News:
    """What a renewal brought: a state or why there is none, the difference model's share.

    Attributes:
        seconds: what it took.
    """

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

    Args:
        source: makes scenes.
        state: what all tabs show; changed only by `look`.
        contents: the messages of now.
        weights: of the difference model, as latched last.
        now: a clock that goes on [s].
    """

    def __init__(
        self,
        source: Source,
        state: State,
        contents: Callable[[], BagContents],
        weights: Callable[[], bytes] = bytes,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._source, self._state, self._contents = source, state, contents
        self._weights, self._now = weights, now
        self._sharer = Sharer(source.model)
        self._thread = ThreadPoolExecutor(1, initializer=_stand_back)
        self._future: Future[News] | None = None
        self._seen, self._due = 0, 0.0
        self.frozen = False
        self.news = News()

    def freeze(self, on: bool) -> None:
        """Keep the data as they are, or go on."""
        self.frozen = on

    def look(self, count: int) -> bool:
        """Take in what is ready, and begin again where more has been measured; whether it did.

        Args:
            count: messages that have come so far.
        """
        taken = self._take() if self._future is not None and self._future.done() else False
        idle = self._future is None and not self.frozen
        if idle and count != self._seen and self._now() >= self._due:
            self._seen = count
            self._future = self._thread.submit(self._renewed, self._contents())
        return taken

    def end(self) -> None:
        """Compute no more."""
        self._thread.shutdown(wait=True, cancel_futures=True)

    def _take(self) -> bool:
        assert self._future is not None
        self.news, self._future = self._future.result(), None
        self._due = self._now() + max(PERIOD - self.news.seconds, REST * self.news.seconds)
        if self.news.state is not None and not self.frozen:
            self._state.become(self.news.state)
            if not self._state.player.playing:
                self._state.go(self._state.player.length)
        return True

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
