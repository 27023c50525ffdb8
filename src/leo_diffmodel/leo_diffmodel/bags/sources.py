# SPDX-License-Identifier: Apache-2.0
"""Telling two robots that publish on one topic from one robot that was started again."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
import math

import numpy as np

BACK_NS = 100_000_000
"""Stamps this much older than the last one mean a restarted robot, or another one."""
AHEAD_NS = 1_000_000_000
"""Stamps this much newer are another publisher's, or the same one's after a pause."""
SILENT = 1.0
"""A robot from which nothing comes for so long has ended [s]."""
LEFT_OVER = 1
"""So many messages may still come from a robot that was started again."""

MOST_LATE = 100
"""A message that comes after so many later ones is another publisher's."""
NONE = np.empty(0)


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
    """A publisher, known by its last message.

    Its stamp [ns], number (None: unknown), time of arrival [s] and values of its joints.
    """

    stamp_ns: int
    number: int | None
    heard: float
    values: np.ndarray
    missing: set[int] = field(default_factory=set)
    """Numbers that it has left out lately; messages may arrive in another order."""

    def take(self, message: Source) -> None:
        """Go on to the next message."""
        left_out = range(self.number + 1, message.number) if self.number and message.number else ()
        if len(left_out) < MOST_LATE:
            self.missing = {n for n in self.missing if n > (message.number or 0) - MOST_LATE}
            self.missing.update(left_out)
        self.stamp_ns, self.number = message.stamp_ns, message.number
        self.heard, self.values = message.heard, message.values


class Sources:
    """The publishers of the same joints on one topic, of which one is recorded.

    A newcomer is taken for the robot started again. Where the former one then goes on, they are
    two: the former is recorded again, until nothing comes from it. Stamps and numbers may be the
    same in both, say of two simulations started at once; then a message belongs to the one whose
    last values it is nearer to.
    """

    def __init__(self) -> None:
        self._all: list[Source] = []
        self._ours: Source | None = None
        self._former: Source | None = None
        self._former_again = 0

    def origin(
        self, stamp_ns: int, number: int | None, now: float, are_two: bool = False,
        values: np.ndarray = NONE,
    ) -> Origin:
        """Say whose message one is.

        Args:
            stamp_ns: its header stamp.
            number: the publisher's count of its messages; None where the middleware has none.
            now: monotonic time of arrival [s].
            are_two: whether a second robot is known from other topics.
            values: of its joints.
        """
        for source in self._all:
            if number in source.missing and _is_near(source, stamp_ns):
                source.missing.remove(number)
                return Origin.OURS if source is self._ours else Origin.OTHER
        ours, message = self._ours, Source(stamp_ns, number, now, values)
        if ours is not None and len(self._all) == 1 and _follows(ours, message):
            ours.take(message)
            return Origin.OURS
        source, is_new = self._source(message)
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

    def _source(self, message: Source) -> tuple[Source, bool]:
        """Return the source of a message, brought up to date, and whether it is a new one."""
        known = [s for s in self._all if s is self._ours or message.heard - s.heard <= SILENT]
        fitting = [s for s in known if _follows(s, message)]
        if not fitting:
            self._all = [*known, message]
            return message, True
        source = min(fitting, key=lambda s: (
            _skipped(s, message.number), not _is_near(s, message.stamp_ns),
            _distance(s, message), s is not self._ours,
        ))
        source.take(message)
        self._all = known
        return source, False


def _follows(source: Source, message: Source) -> bool:
    """Say whether a source may have sent a message: by its number, or by its stamp.

    Without numbers a message of the same stamp is one that is repeated.
    """
    near, number = _is_near(source, message.stamp_ns), message.number
    if number is None or source.number is None:
        return near and (message.stamp_ns != source.stamp_ns or not _distance(source, message))
    return number == source.number + 1 or (near and number > source.number)


def _distance(source: Source, message: Source) -> float:
    """Return how far a message is from what a source said last; infinite where it cannot be."""
    if source.values.size != message.values.size:
        return math.inf
    with np.errstate(all='ignore'):
        off = np.abs(source.values - message.values)
        return float(np.sum(off, where=np.isfinite(off)))


def _is_near(source: Source, stamp_ns: int) -> bool:
    return -BACK_NS <= stamp_ns - source.stamp_ns <= AHEAD_NS


def _skipped(source: Source, number: int | None) -> int:
    """Return how many messages of a source have not come in between; 0 where not known."""
    return 0 if number is None or source.number is None else number - source.number - 1
