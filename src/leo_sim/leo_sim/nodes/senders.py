# SPDX-License-Identifier: Apache-2.0
"""What the middleware says of a command's message: how old it is, and whether two send in turns.

Plain classes: the node brings the clock and the message's facts.
"""

from __future__ import annotations

import math

WINDOW = 1.0
"""Two senders that take turns twice within this time [s] are both commanding."""


class Ages:
    """How long a command was under way, by the time its sender stamped on the message.

    A sender whose clock is ahead of ours is taken as it is: the youngest message so far counts
    as new. One whose clock is behind cannot be told from a slow network, and its commands count
    as old; the clocks of two machines must agree to within the limit.

    Args:
        limit: age [s] from which a command is stale; 0 disables.

    Attributes:
        stale: how many commands were.
    """

    def __init__(self, limit: float) -> None:
        self._limit = limit
        self._youngest = 0.0
        self.stale = 0

    def too_old(self, sent_ns: int, now_ns: int) -> float:
        """The age [s] of a stale command, 0 of any other.

        Args:
            sent_ns: when it was published, by its sender's clock [ns]; 0 where nobody knows.
            now_ns: the time now, by ours [ns].
        """
        if not self._limit or not sent_ns:
            return 0.0
        age = (now_ns - sent_ns) * 1e-9
        self._youngest = min(self._youngest, age)
        if age - self._youngest <= self._limit:
            return 0.0
        self.stale += 1
        return age - self._youngest


class Turns:
    """Notice two senders that command in turns: the message numbers of one sender only grow."""

    def __init__(self) -> None:
        self._number = 0
        self._fell = -math.inf

    def taken(self, number: int | None, now: float) -> bool:
        """Whether the numbers have fallen twice within the window.

        One sender that gives way to another makes them fall once at most.

        Args:
            number: the how-manieth message of its sender; None where the middleware has none.
            now: time [s].
        """
        if number is None:
            return False
        fell, self._number = number <= self._number, number
        if not fell:
            return False
        before, self._fell = self._fell, now
        return now - before < WINDOW
