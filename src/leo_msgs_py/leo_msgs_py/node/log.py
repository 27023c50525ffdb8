# SPDX-License-Identifier: Apache-2.0
"""A node's logger under rclpy's names: stderr in ROS's format, and /rosout."""

from __future__ import annotations

from collections.abc import Callable
import sys
import time

from leo_msgs_py.node.args import LEVELS

# rcl_interfaces/Log levels
NUMBERS = {'debug': 10, 'info': 20, 'warn': 30, 'error': 40, 'fatal': 50}


class Logger:
    """Logs lines of one node.

    Args:
        name: node name shown in each line.
        level: lowest level printed, one of `LEVELS`.
        publish: called with (level, text, file, function, line) for /rosout, or None.
    """

    def __init__(
        self,
        name: str,
        level: str = 'info',
        publish: Callable[[str, str, str, str, int], None] | None = None,
    ) -> None:
        self._name = name
        self._lowest = LEVELS.index(level)
        self._publish = publish
        self._last: dict[tuple[str, int], float] = {}

    def debug(self, text: str, *, throttle_duration_sec: float | None = None) -> None:
        """Log what helps to find a fault."""
        self._log('debug', text, throttle_duration_sec)

    def info(self, text: str, *, throttle_duration_sec: float | None = None) -> None:
        """Log what happens."""
        self._log('info', text, throttle_duration_sec)

    def warning(self, text: str, *, throttle_duration_sec: float | None = None) -> None:
        """Log what may be wrong; at most once per throttle time [s] for one line of code."""
        self._log('warn', text, throttle_duration_sec)

    def error(self, text: str, *, throttle_duration_sec: float | None = None) -> None:
        """Log what is wrong."""
        self._log('error', text, throttle_duration_sec)

    def fatal(self, text: str, *, throttle_duration_sec: float | None = None) -> None:
        """Log what ends the node."""
        self._log('fatal', text, throttle_duration_sec)

    def close(self) -> None:
        """Stop publishing; stderr goes on."""
        self._publish = None

    def _log(self, level: str, text: str, throttle: float | None) -> None:
        if LEVELS.index(level) < self._lowest:
            return
        frame = sys._getframe(2)
        place = (frame.f_code.co_filename, frame.f_lineno)
        now = time.monotonic()
        if throttle is not None and now - self._last.get(place, -throttle) < throttle:
            return
        self._last[place] = now
        print(f'[{level.upper()}] [{time.time():.9f}] [{self._name}]: {text}', file=sys.stderr)
        if self._publish:
            self._publish(level, text, place[0], frame.f_code.co_name, place[1])
