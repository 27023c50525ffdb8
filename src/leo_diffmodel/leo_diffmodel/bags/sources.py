# SPDX-License-Identifier: Apache-2.0
"""Telling a second publisher from a robot that was started again, by their GIDs."""

from __future__ import annotations

from collections.abc import Callable, Collection
from enum import Enum

BACK_NS = 100_000_000
"""Stamps this much older than the last one mean a restarted robot."""
SILENT = 1.0
"""A robot from which nothing comes for so long may have been killed and started again [s]."""
LEASE = 20.0
"""After so long the graph has forgotten one that was killed, by DDS's default [s]."""

Present = Callable[[], Collection[bytes]]
"""GIDs of the publishers that the graph knows now."""


class Origin(Enum):
    """Whose message one is.

    Of the robot that is recorded; of another publisher; of the robot that is recorded again,
    since the other one was not itself after a restart.
    """

    OURS = 'ours'
    OTHER = 'other'
    OURS_AGAIN = 'ours again'


class Sources:
    """The publishers of the same joints on one topic, of which one is recorded.

    A newcomer is the robot started again where the graph has lost the former one, or nothing has
    come from it for a while; where that one then goes on, it is recorded again. One that has
    spoken beside the robot is believed only when the robot has left the graph, or would have.

    Attributes:
        refused: by GID when each other one was first refused [s].
    """

    def __init__(self) -> None:
        self._ours: bytes | None = None
        self._former: bytes | None = None
        self._heard = 0.0
        self.refused: dict[bytes, float] = {}

    def origin(self, publisher: bytes, now: float, present: Present) -> Origin:
        """Say whose message one is.

        Args:
            publisher: its GID.
            now: when it arrived, by a clock that nobody sets [s].
            present: asked only where it matters.
        """
        if publisher == self._former and self._ours is not None:
            self.refused[self._ours] = now
            self._ours, self._former, self._heard = publisher, None, now
            return Origin.OURS_AGAIN
        if self._ours not in (None, publisher):
            if not self._has_ended(publisher, now, present):
                return Origin.OTHER
            self._former = self._ours
        self._ours, self._heard = publisher, now
        return Origin.OURS

    def _has_ended(self, newcomer: bytes, now: float, present: Present) -> bool:
        """Say whether the robot that is recorded has ended, now that a newcomer speaks."""
        is_beside = self.refused.setdefault(newcomer, now) < self._heard
        silent = now - self._heard
        if silent > (LEASE if is_beside else SILENT):
            return True
        if is_beside and silent < SILENT:
            return False
        known = present()
        return newcomer in known and self._ours not in known
