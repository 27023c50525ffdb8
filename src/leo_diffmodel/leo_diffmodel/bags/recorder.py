# SPDX-License-Identifier: Apache-2.0
"""Recording serialized messages into one bag after another; knows no node."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
import struct
import time

from .finish import BagState, finish_bag
from .types import DYNAMIC_JOINT_STATE, JOINT_STATE
from .writer import BagWriter

BACK_NS = 100_000_000
"""Stamps this much older than the last one mean a restarted robot, not a second publisher."""
LATE = 1.0
"""Messages from before a restart may arrive so long after it [s]."""

_STAMP_ENDS = 12
_STAMPED = {JOINT_STATE, DYNAMIC_JOINT_STATE}


@dataclass(frozen=True)
class RecordedTopic:
    """A topic: full name, full type name, `offered_qos_profiles` text, latched or not."""

    name: str
    type: str
    qos: str = ''
    latched: bool = False


class Recorder:
    """Writes what it is given to a bag, and to the next one after a restart of the robot.

    The bag is made with the first message. Latched messages are carried over to the next bag.

    Attributes:
        folder: the bag being written, None before the first message.
        messages: how many were recorded, over all bags.
    """

    def __init__(self, base: Path) -> None:
        """Take the folder for the first bag; `base_1`, `base_2`, ... follow where it exists."""
        self._base = base
        self._writer: BagWriter | None = None
        self._channels: dict[str, int] = {}
        self._last_stamp: dict[str, int] = {}
        self._old_stamp: dict[str, int] = {}
        self._turned = 0.0
        self._latched: dict[str, tuple[RecordedTopic, bytes, int]] = {}
        self._metadata: dict[str, str] = {}
        self.folder: Path | None = None
        self.messages = 0

    def record(
        self, topic: RecordedTopic, data: bytes, published_ns: int = 0, logged_ns: int = 0,
    ) -> None:
        """Write one CDR message; not one that was sent before a restart.

        Args:
            topic: where it came from.
            data: encapsulation header first.
            published_ns: by the publisher's clock, which orders what one node published on
                several topics; 0 where unknown.
            logged_ns: when it arrived; 0 for now.
        """
        if self._is_left_over(topic, data):
            return
        logged_ns = logged_ns or time.time_ns()
        if self._writer is None or self._jumps_back(topic, data):
            self._next_bag(logged_ns)
            self._old_stamp.pop(topic.name, None)
        self._write(topic, data, published_ns, logged_ns)
        self.messages += 1
        if topic.latched:
            self._latched[topic.name] = (topic, data, published_ns)

    def describe(self, metadata: Mapping[str, str]) -> None:
        """Set the `leo` record of this bag and those that follow."""
        if dict(metadata) != self._metadata:
            self._metadata = dict(metadata)
            if self._writer is not None:
                self._writer.add_metadata(self._metadata)

    def flush(self) -> None:
        """Hand everything to the operating system; call this every 0.1 s."""
        if self._writer is not None:
            self._writer.flush()

    @property
    def size(self) -> int:
        """Bytes of the bag being written."""
        return self._writer.size if self._writer else 0

    def close(self) -> None:
        """Finish the bag being written; the next message would open another."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None

    def _next_bag(self, logged_ns: int) -> None:
        self.close()
        self.folder = free_folder(self._base)
        self._writer = BagWriter(self.folder, self._metadata)
        self._channels.clear()
        self._old_stamp, self._last_stamp = self._last_stamp, {}
        self._turned = time.monotonic()
        for latched in self._latched.values():
            self._write(*latched, logged_ns)

    def _write(
        self, topic: RecordedTopic, data: bytes, published_ns: int, logged_ns: int,
    ) -> None:
        assert self._writer is not None
        if topic.name not in self._channels:
            self._channels[topic.name] = self._writer.add_topic(topic.name, topic.type, topic.qos)
        self._writer.write(self._channels[topic.name], data, logged_ns, published_ns)

    def _is_left_over(self, topic: RecordedTopic, data: bytes) -> bool:
        """Whether a topic still goes on where it was when another one jumped back."""
        old = self._old_stamp.pop(topic.name, None)
        if old is None or len(data) < _STAMP_ENDS or time.monotonic() - self._turned > LATE:
            return False
        if header_stamp(data) < old:
            return False
        self._old_stamp[topic.name] = old
        return True

    def _jumps_back(self, topic: RecordedTopic, data: bytes) -> bool:
        if topic.type not in _STAMPED or len(data) < _STAMP_ENDS:
            return False
        stamp = header_stamp(data)
        back = stamp < self._last_stamp.get(topic.name, stamp) - BACK_NS
        self._last_stamp[topic.name] = stamp
        return back


def header_stamp(data: bytes) -> int:
    """Return the stamp [ns] of a CDR message that starts with a header."""
    seconds, nanoseconds = struct.unpack_from('<iI' if data[1] else '>iI', data, 4)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)


def free_folder(base: Path) -> Path:
    """Return `base`, or the first of `base_1`, `base_2`, ... that does not exist."""
    if not base.exists():
        return base
    numbered = (base.with_name(f'{base.name}_{number}') for number in count(1))
    return next(folder for folder in numbered if not folder.exists())


def finish_left_over(base: Path) -> list[Path]:
    """Finish the bags of killed recorders with this base name and return their folders."""
    return [bag for bag in recorded(base) if finish_bag(bag) is BagState.REPAIRED]


def recorded(base: Path) -> list[Path]:
    """Return the bags with this base name, the one being written too."""
    folders = [base, *sorted(base.parent.glob(f'{base.name}_*'))]
    return [folder for folder in folders if folder.is_dir() and any(folder.glob('*.mcap'))]
