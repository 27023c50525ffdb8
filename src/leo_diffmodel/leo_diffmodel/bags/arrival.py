# SPDX-License-Identifier: Apache-2.0
"""Messages as they arrive: when, by a clock that nobody sets, and from whose robot."""

from collections.abc import Callable, Collection
from enum import Enum
import time

Clock = Callable[[], int]  # a time in ns


class ArrivalTimes:
    """Log times that go on evenly while the clock on the wall is set.

    The middleware says when a message arrived by that clock. Here that is brought to a time since
    the start by a steady clock, and into the span in which it must have arrived.
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


class Numbers:
    """What is missing of what a publisher sent on a topic, by the numbers of its messages."""

    def __init__(self, first: int) -> None:
        self._first = self._last = first

    def missed(self, number: int) -> int:
        """How many more are missing now that this one has come; -1 where it comes late."""
        more = number - self._last - 1
        if more < 0:
            return -1 if self._first < number < self._last else 0
        self._last = number
        return more


SILENT = 1.0  # s: so long silent, a robot may have been killed and started again
LEASE = 20.0  # after so long the graph has forgotten one that was killed, by DDS's default [s]

Present = Callable[[], Collection[bytes]]  # GIDs of the publishers that the graph knows now


class Origin(Enum):
    """Whose message one is.

    Of the robot that is recorded, of another publisher, or of the robot that is recorded again,
    since the other one was not itself after a restart.
    """

    OURS = 'ours'
    OTHER = 'other'
    OURS_AGAIN = 'ours again'


class Sources:
    """The publishers of the same joints on one topic, of which one is recorded.

    A newcomer is the robot started again where the graph has lost the former one, or nothing has
    come from it for a while; where that one then goes on, it is recorded again. One that has
    spoken at the same time as the robot is believed only when the robot has left the graph, or
    would have. `refused` has by GID when each other one was first refused [s].
    """

    def __init__(self) -> None:
        self._ours: bytes | None = None
        self._former: bytes | None = None
        self._last = 0.0
        self.refused: dict[bytes, float] = {}

    def origin(self, publisher: bytes, now: float, present: Present) -> Origin:
        """Say whose message one is, by its GID; `now` [s] is of a clock that nobody sets."""
        if publisher == self._former and self._ours is not None:
            self.refused[self._ours] = now
            self._ours, self._former, self._last = publisher, None, now
            return Origin.OURS_AGAIN
        if self._ours not in (None, publisher):
            if not self._has_ended(publisher, now, present):
                return Origin.OTHER
            self._former = self._ours
        self._ours, self._last = publisher, now
        return Origin.OURS

    def _has_ended(self, newcomer: bytes, now: float, present: Present) -> bool:
        """Say whether the robot that is recorded has ended, now that a newcomer speaks."""
        overlaps = self.refused.setdefault(newcomer, now) < self._last
        silent = now - self._last
        if silent > (LEASE if overlaps else SILENT):
            return True
        if overlaps and silent < SILENT:
            return False
        known = present()
        return newcomer in known and self._ours not in known
