# SPDX-License-Identifier: Apache-2.0
"""The last seconds of what a robot says, as the messages that a bag would hold, and how it is."""

from collections import deque
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Lock
import time

from leo_diffmodel.bags.arrival import Origin, Sources
from leo_diffmodel.bags.recorder import RECENT, TWO
from leo_diffmodel.bags.types import JOINT_STATE, STATES, Topic
from leo_msgs_py.bag_contents import BagContents, Logged, TopicLog
from leo_msgs_py.cdr import joints_text

NAME = 'the running robot'
MOST = 60_000  # messages of a topic that are kept at most, however fast they come
HEADER = 12  # bytes up to the end of a stamp
SILENT = 1.5  # a robot from which no state comes for so long has ended, or waits [s]
GONE = (
    'no state from the robot for {:.0f} s: it ended, waits for a command, or cannot be reached. '
    'What was measured stays; the page goes on when it comes back'
)


class MessageBuffer:
    """Takes what `GraphRecorder` hands to a recorder, and keeps its last `seconds` [s].

    Where the robot falls silent nothing is forgotten: time is that of the newest message. Of two
    robots that publish the same joints one is kept.

    Attributes:
        last_state: monotonic time of the last joint state [s]; None before the first.
        publishers: what the graph knows of a topic's publishers, their GIDs.
    """

    folder = None  # no bag is written
    troubles: tuple[str, ...] = ()
    strangers = 0  # they are named on the page

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.last_state: float | None = None
        self.lost = self.foreign = self.messages = self.size = 0
        self.full = ''
        self._two = float('-inf')
        self._lock = Lock()
        self._topics: dict[str, tuple[Topic, deque[Logged]]] = {}
        self._sources: dict[tuple[str, bytes], Sources] = {}
        self._facts: dict[str, str] = {}
        self.publishers: Callable[[str], Collection[bytes]] = lambda _: ()

    @property
    def two(self) -> bool:
        return time.monotonic() - self._two < RECENT

    def record(
        self,
        topic: Topic,
        data: bytes,
        published_ns: int = 0,
        logged_ns: int = 0,
        number: int = 0,
        publisher: bytes = b'',
    ) -> None:
        """Keep one CDR message; the arguments are those of `Recorder.record`."""
        logged_ns = logged_ns or time.time_ns()
        with self._lock:
            if not self._is_ours(topic, data, publisher, logged_ns):
                return
            _, kept = self._topics.setdefault(topic.name, (topic, deque(maxlen=MOST)))
            kept.append(Logged(logged_ns, data, published_ns or logged_ns))
            oldest = logged_ns - round(self.seconds * 1e9)
            while len(kept) > 1 and kept[0].log_ns < oldest:  # the last may be latched
                kept.popleft()
            self.messages += 1
        if topic.name.endswith(STATES.name):
            self.last_state = time.monotonic()

    def describe(self, metadata: Mapping[str, str]) -> None:
        self._facts = dict(metadata)

    def flush(self) -> None:
        """Nothing waits to be written."""

    def close(self) -> None:
        """Nothing is open."""

    def contents(self) -> BagContents:
        with self._lock:
            topics = {
                name: TopicLog(name, topic.type, topic.qos, [*kept])
                for name, (topic, kept) in self._topics.items()
            }
        return BagContents(Path(NAME), (), topics, {'leo': self._facts}, True, 0)

    def _is_ours(self, topic: Topic, data: bytes, publisher: bytes, logged_ns: int) -> bool:
        """Whether a message is not of a second robot; begin anew where the first comes back."""
        if topic.type != JOINT_STATE or len(data) < HEADER:
            return True
        sources = self._sources.setdefault((topic.name, joints_text(data)), Sources())
        origin = sources.origin(publisher, logged_ns * 1e-9, partial(self.publishers, topic.name))
        if origin is not Origin.OURS:
            self.foreign, self._two = self.foreign + 1, time.monotonic()
        if origin is Origin.OURS_AGAIN:
            self._topics.clear()
        return origin is not Origin.OTHER


@dataclass
class Condition:
    e_stopped: bool | None = None  # as latched; None where it says nothing
    message: str = ''  # its own line on /diagnostics
    level: int = 0  # of that line; 0 where all is well
    trouble: str = ''  # why the newest data are not shown; '' where they are

    def line(self, buffer: MessageBuffer) -> tuple[bool, str]:
        if is_silent(buffer):
            return False, GONE.format(_silence(buffer))
        if buffer.two:
            return False, TWO.replace('recorded', 'shown')
        if self.trouble:
            return False, self.trouble
        if self.e_stopped:
            return False, self.message or 'e-stop'
        return not self.level, self.message or 'running'


def is_silent(buffer: MessageBuffer) -> bool:
    return _silence(buffer) > SILENT


def _silence(buffer: MessageBuffer) -> float:
    """Since the last state [s]."""
    return time.monotonic() - buffer.last_state if buffer.last_state else 0.0
