# SPDX-License-Identifier: Apache-2.0
"""How long an emulated bus has listened, which it tells over its pseudo-terminal.

A real servo hears at once. An emulated one waits for a processor: time in which it did not run
is none in which it could have answered. The size of a terminal's window is 64 bits that both
ends see and that a serial line has no use for (0 there); here they are a time in us.
"""

from collections.abc import Callable
from fcntl import ioctl
import os
import struct
from termios import TIOCGWINSZ, TIOCSWINSZ

from leo_sim.drivers.base import Computer

GONE = 1.0
"""A bus that has not listened for so long [s] is dead or stopped: from then on time counts."""
PSEUDO = range(136, 144)
"""Major device numbers of pseudo-terminals on Linux: a real line is never taken for one."""


def tell(end: int, seconds: float) -> None:
    ioctl(end, TIOCSWINSZ, struct.pack('=Q', round(seconds * 1e6) + 1))


def told(port: int) -> float:
    """For how long the other end has listened [s]; 0 where it is no emulated bus."""
    try:
        if os.major(os.fstat(port).st_rdev) not in PSEUDO:
            return 0.0
        (count,) = struct.unpack('=Q', ioctl(port, TIOCGWINSZ, bytes(8)))
    except OSError:
        return 0.0
    return float(count) * 1e-6


def answering_time(port: int, computer: Computer) -> Callable[[], float]:
    """The time [s] by which an answer on a port is late: the wall's, unless the bus tells its."""
    if not told(port):
        return computer.monotonic
    heard, seen = 0.0, computer.monotonic()

    def listened() -> float:
        nonlocal heard, seen
        now, count = computer.monotonic(), told(port)
        if count != heard:
            heard, seen = count, now
        return heard + max(0.0, now - seen - GONE)

    return listened
