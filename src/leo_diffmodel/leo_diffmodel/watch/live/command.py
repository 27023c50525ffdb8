# SPDX-License-Identifier: Apache-2.0
"""A `leo` command in a process of its own, which ends in its own way when it is asked to."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
import signal
import subprocess
import sys
from typing import IO

LEO = 'import sys; from leo_msgs_py.cli import main; sys.exit(main())'
GRACE = 10.0
"""What it may take to end [s]."""


class Command:
    """Starts and ends the process."""

    def __init__(self) -> None:
        self._process: subprocess.Popen | None = None

    @property
    def on(self) -> bool:
        """Whether it runs."""
        return self._process is not None and self._process.poll() is None

    @property
    def ended(self) -> int | None:
        """Its exit status; None before it was started and while it runs."""
        return self._process.poll() if self._process else None

    def start(self, words: Sequence[str], told: IO | None = None) -> None:
        """Start it, unless it runs.

        Args:
            words: after `leo`.
            told: takes what it prints; None: stdout is left out, stderr is that of this process.
        """
        if self.on:
            return
        self._process = subprocess.Popen(
            [sys.executable, '-c', LEO, *words],
            stdin=subprocess.DEVNULL,
            stdout=told or subprocess.DEVNULL,
            stderr=told,
        )

    def stop(self) -> None:
        """Have it end."""
        if self.on and self._process is not None:
            self._process.send_signal(signal.SIGTERM)

    def wait(self) -> None:
        """Have it end, and wait for that."""
        self.stop()
        if self._process is not None:
            with suppress(subprocess.TimeoutExpired):  # it goes on, and ends by itself
                self._process.wait(GRACE)
