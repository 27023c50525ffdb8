# SPDX-License-Identifier: Apache-2.0
"""What all nodes of a process share on DDS: participant, graph, spinning, signals."""

from __future__ import annotations

import atexit
import os
import signal
import threading
import time
from typing import Any, TYPE_CHECKING

from leo_msgs_py.wire.graph import Graph
from leo_msgs_py.wire.participant import Participant, Reader, Waker

if TYPE_CHECKING:
    from leo_msgs_py.node.dds_backend import DdsNode

_FOREVER_NS = 3_600_000_000_000


class Context:
    """One participant, the nodes on it, and the loop that runs their callbacks."""

    def __init__(self) -> None:
        self.participant = Participant.from_environment()
        self.graph = Graph(self.participant)
        self.nodes: list[DdsNode] = []
        self.running = True
        self._waker = Waker(self.participant.entity)
        self._waker.attach(self.graph.reader, self.graph.take)
        self._requests = 0
        self._signals = _Signals(self) if _in_main_thread() else None
        atexit.register(self.shutdown)

    def attach(self, reader: Reader, callback: Any) -> None:
        """Have the spinning thread call back while the reader holds samples."""
        self._waker.attach(reader, callback)

    def detach(self, reader: Reader) -> None:
        """Forget a reader."""
        self._waker.detach(reader)

    def next_request(self) -> int:
        """Sequence number of a service request, counted once per process as ROS does."""
        self._requests += 1
        return self._requests

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Run what is ready, waiting for it at most so long (None: until something is)."""
        limit = _FOREVER_NS if timeout_sec is None else round(timeout_sec * 1e9)
        deadline = time.monotonic_ns() + limit
        while self.running:
            ready = self._waker.wait(max(0, min(deadline - time.monotonic_ns(), self._due_ns())))
            for callback in ready:
                callback()
            ran = self._run_timers()
            if ran or any(callback != self.graph.take for callback in ready):
                return
            if time.monotonic_ns() >= deadline:
                return

    def stop(self) -> None:
        """End spinning; `shutdown` then leaves the graph (from any thread or a signal)."""
        self.running = False
        self._waker.wake()

    def shutdown(self) -> None:
        """Destroy the nodes and leave the domain, so that peers see it at once."""
        atexit.unregister(self.shutdown)
        self.running = False
        for node in list(self.nodes):
            node.destroy_node()
        if self._signals:
            self._signals.restore()
        self._waker.close()
        self.participant.close()

    def _due_ns(self) -> int:
        wall = [t for node in self.nodes for t in node.timers if not t.simulated]
        return min((t.remaining_ns() for t in wall if not t.is_canceled()), default=_FOREVER_NS)

    def _run_timers(self) -> bool:
        timers = [timer for node in self.nodes for timer in node.timers]
        due = [timer.call_if_due() for timer in timers]
        return any(due)


class _Signals:
    """Ends spinning on SIGINT and SIGTERM; a second SIGINT interrupts whatever runs."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._pipe = os.pipe()
        os.set_blocking(self._pipe[1], False)
        self._previous_fd = signal.set_wakeup_fd(self._pipe[1], warn_on_full_buffer=False)
        self._previous = {
            number: signal.signal(number, self._handle)
            for number in (signal.SIGINT, signal.SIGTERM)
        }
        # Python runs handlers between bytecodes only; this wakes the wait they are stuck in.
        self._thread = threading.Thread(target=self._wake, name='signals', daemon=True)
        self._thread.start()

    def restore(self) -> None:
        """Put the handlers back as they were."""
        for number, handler in self._previous.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(self._previous_fd)
        os.close(self._pipe[1])
        self._thread.join()
        os.close(self._pipe[0])

    def _handle(self, number: int, frame: Any) -> None:
        if not self._context.running and number == signal.SIGINT:
            raise KeyboardInterrupt
        self._context.stop()

    def _wake(self) -> None:
        while os.read(self._pipe[0], 1):
            self._context._waker.wake()


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
