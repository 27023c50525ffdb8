# SPDX-License-Identifier: Apache-2.0
"""Where in the recording one is: play, pause, speed, scrub."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import time

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass
class Player:
    """A clock that runs from 0 to the end and begins again.

    Attributes:
        length: of what is played [s].
        clock: seconds that go on.
        speed: times as fast as it was.
    """

    length: float
    clock: Callable[[], float] = time.monotonic
    speed: float = 1.0
    _from: float = 0.0
    _since: float | None = None

    @property
    def playing(self) -> bool:
        """Whether time goes on."""
        return self._since is not None

    @property
    def now(self) -> float:
        """Where it is [s]."""
        if self._since is None:
            return self._from
        return (self._from + self.speed * (self.clock() - self._since)) % self.length

    def go(self, seconds: float) -> None:
        """Go there, playing or not."""
        self._from = min(max(seconds, 0.0), self.length)
        self._since = self.clock() if self.playing else None

    def play(self, on: bool = True) -> None:
        """Go on from here, or stand still."""
        self._from = self.now
        self._since = self.clock() if on else None

    def at_speed(self, speed: float) -> None:
        """Another speed from here on."""
        self.go(self.now)
        self.speed = speed
