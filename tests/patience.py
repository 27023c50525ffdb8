# SPDX-License-Identifier: Apache-2.0
"""How long a test waits for what must happen, on a machine however busy."""

from collections.abc import Callable
import time

PATIENCE = 600.0  # s; nothing that passes takes it


def until(true: Callable[[], object], what: str = 'nothing happened') -> None:
    """Wait for something to be so."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end, what
        time.sleep(0.05)
