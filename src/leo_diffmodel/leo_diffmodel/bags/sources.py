# SPDX-License-Identifier: Apache-2.0
"""Telling two robots that publish on one topic from one robot that was started again."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

BACK_NS = 100_000_000
"""Stamps this much older than the last one mean a restarted robot, or another one."""
AHEAD_NS = 1_000_000_000
"""Stamps this much newer are another publisher's, or the same one's after a pause."""
SILENT = 1.0
"""A robot from which nothing comes for so long has ended [s]."""
LEFT_OVER = 1
"""So many messages may still come from a robot that was started again."""


class Origin(Enum):
    """Whose message one is.

    Of the robot that is recorded; left over from before it was started again; of another robot;
    of the robot that is recorded again, since the other one was not itself after a restart.
    """

    OURS = 'ours'
    LEFT_OVER = 'left over'
    OTHER = 'other'
    OURS_AGAIN = 'ours again'


@dataclass
class Source:
    """A publisher, known by its last message: stamp [ns], number (None: unknown), arrival [s]."""

    stamp_ns: int
    number: int | None
    heard: float


class Sources:
    """The publishers of the same joints on one topic, of which one is recorded.

    A newcomer is taken for the robot started again. Where the former one then goes on, they are
    two: the former is recorded again, until nothing comes from it.
    """

    def __init__(self) -> None:
        self._all: list[Source] = []
        self._ours: Source | None = None
        self._former: Source | None = None
        self._former_again = 0

    def origin(
        self, stamp_ns: int, number: int | None, now: float, are_two: bool = False,
    ) -> Origin:
        """Say whose message one is.

        Args:
            stamp_ns: its header stamp.
            number: the publisher's count of its messages; None where the middleware has none.
            now: monotonic time of arrival [s].
            are_two: whether a second robot is known from other topics.
        """
        ours = self._ours
        if ours is not None and len(self._all) == 1 and _follows(ours, stamp_ns, number):
            ours.stamp_ns, ours.number, ours.heard = stamp_ns, number, now
            return Origin.OURS
        source, is_new = self._source(stamp_ns, number, now)
        if source is ours:
            return Origin.OURS
        if ours is None or (is_new and not are_two) or now - ours.heard > SILENT:
            self._ours, self._former, self._former_again = source, ours, 0
            return Origin.OURS
        if source is not self._former:
            return Origin.OTHER
        self._former_again += 1
        if self._former_again <= LEFT_OVER:
            return Origin.LEFT_OVER
        self._ours, self._former = source, None
        return Origin.OURS_AGAIN

    def _source(self, stamp_ns: int, number: int | None, now: float) -> tuple[Source, bool]:
        """Return the source of a message, brought up to date, and whether it is a new one."""
        known = [s for s in self._all if s is self._ours or now - s.heard <= SILENT]
        fitting = [s for s in known if _follows(s, stamp_ns, number)]
        if not fitting:
            source = Source(stamp_ns, number, now)
            self._all = [*known, source]
            return source, True
        source = min(fitting, key=lambda s: (
            _skipped(s, number), not _is_near(s, stamp_ns), s is not self._ours,
        ))
        source.stamp_ns, source.number, source.heard = stamp_ns, number, now
        self._all = known
        return source, False


def _follows(source: Source, stamp_ns: int, number: int | None) -> bool:
    """Say whether a source may have sent a message: by its number, or by its stamp."""
    near = _is_near(source, stamp_ns)
    if number is None or source.number is None:
        return near
    return number == source.number + 1 or (near and number > source.number)


def _is_near(source: Source, stamp_ns: int) -> bool:
    return -BACK_NS <= stamp_ns - source.stamp_ns <= AHEAD_NS


def _skipped(source: Source, number: int | None) -> int:
    """Return how many messages of a source have not come in between; 0 where not known."""
    return 0 if number is None or source.number is None else number - source.number - 1
