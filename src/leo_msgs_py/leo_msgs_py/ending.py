# SPDX-License-Identifier: Apache-2.0
"""What ends a command early: a signal, or the time that it was given."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
import math
import os
from pathlib import Path
import signal
import stat
import sys
from threading import current_thread, main_thread, Thread
import time
from types import FrameType

BEGAN: ContextVar[float] = ContextVar('BEGAN')
"""When the command was typed [s of `time.monotonic`]."""
LEAVING = 0.5  # s that it takes to say what was kept and to leave Python
AGAIN = 0.2  # s after which it is raised again: callbacks of compiled code drop exceptions
LOOK = 0.5  # s between two looks at the process that started this one
PARENT = 'LEO_PARENT'  # in whose environment a command ends with the process of this number
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Ended(KeyboardInterrupt):
    def __init__(self, number: int) -> None:
        self.number = signal.Signals(number)
        super().__init__(self.number.name)

    @classmethod
    def of(cls, by: KeyboardInterrupt) -> 'Ended':
        return by if isinstance(by, cls) else cls(signal.SIGINT)

    @property
    def in_time(self) -> bool:
        return self.number == signal.SIGALRM

    @property
    def status(self) -> int:
        return 128 + self.number


def end(number: int, _: FrameType | None = None) -> None:
    """Handle a signal: raise `Ended`. A terminal that was closed takes no more output."""
    if number == signal.SIGHUP:
        for stream in (1, 2):
            if stat.S_ISCHR(os.fstat(stream).st_mode):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    raise Ended(number)


@contextmanager
def ending(until: float = math.inf) -> Iterator[None]:
    """Raise `Ended` at a signal, and in time to be over `until` [s of `time.monotonic`]."""
    if current_thread() is not main_thread():  # signals are not for the others
        yield
        return
    first: list[int] = []
    inside = True

    def ended(number: int, frame: FrameType | None) -> None:
        if inside:
            first.append(number)
            signal.setitimer(signal.ITIMER_REAL, AGAIN, AGAIN)
            end(first[0], frame)

    able = [n for n in SIGNALS if signal.getsignal(n) is not signal.SIG_IGN]
    before = {n: signal.getsignal(n) for n in (*able, signal.SIGALRM)}
    try:
        for number in before:
            signal.signal(number, ended)
        if until < math.inf:
            signal.setitimer(signal.ITIMER_REAL, max(until - LEAVING - time.monotonic(), 1e-6))
        yield
    finally:
        inside = False
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def told_when_ended() -> Iterator[None]:
    """End soon at a signal, and say so, what writes nothing before it comes to its end."""
    try:
        with ending():
            yield
    except KeyboardInterrupt as by:
        say(f'leo: ended by {Ended.of(by).number.name}: no answer is kept; bags are')
        raise


def say(text: str) -> None:
    with suppress(OSError, ValueError):  # nobody reads any more
        print(text, file=sys.stderr, flush=True)


def end_with(parent: int, number: int = signal.SIGKILL) -> None:
    """Have a signal end this process once the one that started it is gone, by kill -9 too."""

    def wait() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK)
        os.kill(os.getpid(), number)

    Thread(target=wait, daemon=True).start()


def process_began() -> float:
    """When this process was started, or now where no system says that [s of `time.monotonic`]."""
    file = Path('/proc/self/stat')
    if not file.exists():
        return time.monotonic()
    began = int(file.read_text().rpartition(')')[2].split()[19]) / os.sysconf('SC_CLK_TCK')
    return time.monotonic() - (time.clock_gettime(time.CLOCK_BOOTTIME) - began)
