# SPDX-License-Identifier: Apache-2.0
"""When messages arrived, by a clock that nobody sets."""

from __future__ import annotations

from collections.abc import Callable
import time

Clock = Callable[[], int]
"""A time in ns."""


class ArrivalTimes:
    """Log times that go on evenly while the clock on the wall is set.

    The middleware says when a message arrived by the clock on the wall. Here that is brought to
    a time since the start, which never jumps, and into the span in which it must have arrived.

    Args:
        wall: the clock on the wall, whose time at the start counts.
        steady: a clock that never jumps.
    """

    def __init__(self, wall: Clock = time.time_ns, steady: Clock = time.monotonic_ns) -> None:
        self._wall, self._steady = wall, steady
        self._start = wall() - steady()
        self._since = self._asked = self._now = steady()
        self._before = self._offset = self._start

    def begin(self) -> None:
        """Note that messages are about to be taken; none can have come before the last time."""
        self._since, self._asked = self._asked, self._steady()

    def end(self) -> None:
        """Note that all messages are taken: all of them have come by now."""
        self._now = self._steady()
        self._before, self._offset = self._offset, self._wall() - self._now

    def logged(self, received_ns: int) -> int:
        """Return the log time of a message [ns], from when it arrived by the clock on the wall."""
        for offset in (self._before, self._offset):
            if self._since <= received_ns - offset <= self._now:
                return self._start + received_ns - offset
        return self._start + min(max(received_ns - self._offset, self._since), self._now)
