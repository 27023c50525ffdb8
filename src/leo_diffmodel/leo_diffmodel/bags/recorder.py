# SPDX-License-Identifier: Apache-2.0
"""Recording serialized messages into one bag after another; knows no node."""

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from itertools import chain, count
from pathlib import Path
import struct
import time

from leo_msgs_py.cdr import joints_text
from leo_msgs_py.errors import UserError

from .arrival import Numbers, Origin, Sources
from .types import DYNAMIC_JOINT_STATE, JOINT_STATE, Topic
from .writer import BagWriter, make_folder

BACK_NS = 100_000_000  # stamps this much older than the last one mean a restarted robot
LATE = 1.0  # messages from before a restart may arrive so long after it [s]
RECENT = 5.0  # what has gone wrong counts as a trouble for so long [s]

TWO = (
    'two robots publish the states of the same joints, and only one of them is recorded; give '
    'each a namespace (-r __ns:=/left) or a ROS_DOMAIN_ID of its own'
)
MISSED = 'messages that were sent never came: this computer is too slow, or stood still'
_STAMP_ENDS = 12
_STAMPED = {JOINT_STATE, DYNAMIC_JOINT_STATE}


class Recorder:
    """Writes what it is given to a bag, and to the next one after a restart of the robot.

    The bag is made with the first message. Latched messages are carried over to the next bag.
    Messages that never came are counted, as are those that a full disk does not take; recording
    goes on when there is room. Where a bag is moved or removed, the next one begins. Of two robots
    one is recorded.
    """

    def __init__(self, base: Path) -> None:
        """Take the folder for the first bag; `base_1`, `base_2`, ... follow where it exists."""
        first = free_folder(base)
        make_folder(first)
        first.rmdir()
        self._base = base
        self._writer: BagWriter | None = None
        self._sources: dict[tuple[str, bytes], Sources] = {}
        self._leads: dict[str, Sources] = {}
        self._numbers: dict[tuple[str, bytes], Numbers] = {}
        self._last_stamp: dict[str, int] = {}
        self._old_stamp: dict[str, int] = {}
        self._turned, self._turned_by = 0.0, ''
        self._latched: dict[str, tuple[Topic, bytes, int]] = {}
        self._metadata: dict[str, str] = {}
        self._troubles: dict[str, float] = {}
        self.folder: Path | None = None  # the bag being written, None before the first message
        self.messages = 0  # recorded, over all bags
        self.lost = 0  # never came, came without room, or went with a bag that was removed
        self._lost_before = self._lost_said = 0
        self.foreign = 0  # of a second robot, left out
        self.full = ''  # why nothing can be written now; '' where all is well
        self.publishers: Callable[[str], Collection[bytes]] = lambda _: ()
        """What the graph knows of a topic's publishers, their GIDs."""

    def record(
        self,
        topic: Topic,
        data: bytes,
        published_ns: int = 0,
        logged_ns: int = 0,
        number: int = 0,
        publisher: bytes = b'',
    ) -> None:
        """Write one CDR message; not one of a second robot or sent before a restart.

        `published_ns` is by the publisher's clock, which orders what one node published on several
        topics, `number` how many it has sent on the topic (both 0 where unknown), `logged_ns` when
        the message arrived (0 for now), `publisher` its GID. Raises UserError where the first bag
        cannot be made any more.
        """
        logged_ns, missed = logged_ns or time.time_ns(), self._missed(topic, publisher, number)
        if not self._is_ours(topic, data, publisher, logged_ns) or self._is_left_over(topic, data):
            return
        if self._jumps_back(topic, data, logged_ns) or not (self._writer or self.full):
            self._next_bag(logged_ns, topic)
        self._miss(missed)
        if topic.latched:
            self._latched[topic.name] = (topic, data, published_ns)
        if self._writer is None or self.full:
            self.lost += 1
        else:
            self.messages += 1
            self._write(self._writer, topic, data, logged_ns, published_ns, number)

    def describe(self, metadata: Mapping[str, str]) -> None:
        if dict(metadata) != self._metadata:
            self._metadata = dict(metadata)
            if self._writer is not None:
                self._write_facts(self._writer)

    def flush(self) -> None:
        """Hand everything to the operating system every 0.1 s; go on where there is room."""
        if self._writer is not None and not self._writer.is_there:
            self._leave(self._writer)
        if self._writer is not None:
            self._flush(self._writer)
        elif self.full:
            self._open(time.time_ns())

    @property
    def troubles(self) -> list[str]:
        now = time.monotonic()
        full = [f'nothing can be written, messages are lost: {self.full}'] if self.full else []
        return [*full, *(text for text, at in self._troubles.items() if now - at < RECENT)]

    @property
    def size(self) -> int:
        return self._writer.size if self._writer else 0

    def close(self) -> None:
        """Finish the bag being written; the next message would open another.

        Where the disk is full, what it did not take is lost; the bag is one that was cut short.
        """
        writer, self._writer = self._writer, None
        if writer is not None:
            self._say_lost(writer)
            with self._disk():
                writer.close()
            self._lose(writer.unsaved)

    @property
    def strangers(self) -> int:
        return len(set().union(*(sources.refused for sources in self._sources.values())))

    def _is_ours(self, topic: Topic, data: bytes, publisher: bytes, logged_ns: int) -> bool:
        """Say whether to record a message; begin a bag for the robot that is recorded again."""
        if not _has_stamp(topic, data):
            return True
        sources = self._sources.setdefault((topic.name, joints_text(data)), Sources())
        origin = sources.origin(publisher, logged_ns * 1e-9, partial(self.publishers, topic.name))
        if origin is not Origin.OURS:
            self.foreign += origin is Origin.OTHER
            self._troubles[TWO] = time.monotonic()
        if origin is Origin.OURS_AGAIN and topic.name == self._turned_by:
            self._next_bag(logged_ns)
            self._old_stamp.clear()
        return origin is not Origin.OTHER

    def _next_bag(self, logged_ns: int, topic: Topic | None = None) -> None:
        self.close()
        self._lost_before = self.lost
        self._old_stamp, self._last_stamp = self._last_stamp, {}
        self._turned = time.monotonic()
        if topic is not None:
            self._turned_by = topic.name
            self._old_stamp.pop(topic.name, None)
        self._open(logged_ns)

    def _open(self, logged_ns: int) -> None:
        is_first, self.folder = self.folder is None, free_folder(self._base)
        try:
            self._writer = BagWriter(self.folder)
        except UserError as error:
            if is_first:
                raise
            self.full = str(error)
            return
        self.full = ''
        self._write_facts(self._writer)
        self._write_latched(self._writer, logged_ns)

    def _flush(self, writer: BagWriter) -> None:
        was_full, self.full = self.full, ''
        with self._disk():
            writer.flush()
        self._say_lost(writer)
        if was_full and not self.full:
            self._write_latched(writer, time.time_ns())

    def _leave(self, writer: BagWriter) -> None:
        trouble = f'{self.folder} was moved or removed while it was recorded'
        self._troubles[trouble] = time.monotonic()
        if writer.is_removed:
            self._lose(writer.count - writer.unsaved)
        self.close()

    def _missed(self, topic: Topic, publisher: bytes, number: int) -> int:
        numbers = self._numbers.setdefault((topic.name, publisher), Numbers(number))
        return numbers.missed(number) if topic.whole else 0

    def _miss(self, messages: int) -> None:
        self.lost += messages
        if messages > 0:
            self._troubles[MISSED] = time.monotonic()

    def _say_lost(self, writer: BagWriter) -> None:
        if self.lost != self._lost_said and not self.full:
            self._write_facts(writer)

    def _lose(self, messages: int) -> None:
        self.lost += messages
        self.messages -= messages

    @contextmanager
    def _disk(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self.full = f'{self.folder}: {error.strerror or error}'

    def _write_facts(self, writer: BagWriter) -> None:
        self._lost_said, lost = self.lost, self.lost - self._lost_before
        facts = self._metadata | ({'lost': str(lost)} if lost else {})
        if facts:
            with self._disk():
                writer.add_metadata(facts)

    def _write_latched(self, writer: BagWriter, logged_ns: int) -> None:
        for topic, data, published_ns in self._latched.values():
            self._write(writer, topic, data, logged_ns, published_ns)

    def _write(self, writer: BagWriter, topic: Topic, data: bytes, *times: int) -> None:
        channel = writer.add_topic(*topic)
        with self._disk():
            writer.write(channel, data, *times)

    def _is_left_over(self, topic: Topic, data: bytes) -> bool:
        """Whether a topic still goes on where it was when another one jumped back."""
        old = self._old_stamp.pop(topic.name, None)
        if old is None or len(data) < _STAMP_ENDS or time.monotonic() - self._turned > LATE:
            return False
        if header_stamp(data) < old:
            return False
        self._old_stamp[topic.name] = old
        return True

    def _jumps_back(self, topic: Topic, data: bytes, logged_ns: int) -> bool:
        """Whether the stamps of a topic do; of several groups of joints those of the first."""
        if not _has_stamp(topic, data):
            return False
        lead = self._leads.setdefault(topic.name, Sources())
        if lead.origin(joints_text(data), logged_ns * 1e-9, tuple) is Origin.OTHER:
            return False
        stamp = header_stamp(data)
        back = stamp < self._last_stamp.get(topic.name, stamp) - BACK_NS
        self._last_stamp[topic.name] = stamp
        return back


def _has_stamp(topic: Topic, data: bytes) -> bool:
    return topic.type in _STAMPED and len(data) >= _STAMP_ENDS


def header_stamp(data: bytes) -> int:
    seconds, nanoseconds = struct.unpack_from('<iI' if data[1] else '>iI', data, 4)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)


def free_folder(base: Path) -> Path:
    """Return `base`, or the first of `base_1`, `base_2`, ... that does not exist."""
    numbered = (base.with_name(f'{base.name}_{number}') for number in count(1))
    return next(folder for folder in chain([base], numbered) if not folder.exists())
