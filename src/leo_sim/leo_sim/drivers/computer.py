# SPDX-License-Identifier: Apache-2.0
"""What a driver of hardware has of its computer: the time, and serial ports."""

from __future__ import annotations

import time
from typing import Any


class Computer:
    """This one. Tests bring another, whose time passes only where somebody waits for it."""

    def monotonic(self) -> float:
        """Time [s] that nobody sets."""
        return time.monotonic()

    def time_ns(self) -> int:
        """The wall's time, for stamps."""
        return time.time_ns()

    def sleep(self, seconds: float) -> None:
        """Wait [s]."""
        time.sleep(seconds)

    def serial(self, path: str, baud: int, wait: float) -> Any:
        """A serial port opened for this process alone; a look for bytes waits at most `wait` [s].

        Raises:
            OSError: there is none, or it is not ours to open.
        """
        from serial import Serial

        return Serial(path, baud, timeout=wait, exclusive=True)


THIS = Computer()
