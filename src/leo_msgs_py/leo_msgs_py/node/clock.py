# SPDX-License-Identifier: Apache-2.0
"""Clocks of a node: the system's, or what /clock says with `use_sim_time`."""

from __future__ import annotations

from dataclasses import dataclass
import time
from typing import Any

from leo_msgs_py.values import time_message


@dataclass(frozen=True, order=True)
class Time:
    """A point in time.

    Attributes:
        nanoseconds: since the epoch, or since the start of the simulation [ns].
    """

    nanoseconds: int

    def to_msg(self) -> Any:
        """As builtin_interfaces/Time."""
        return time_message(self.nanoseconds)


class Clock:
    """The ROS clock of a node: system time until simulated time is switched on."""

    def __init__(self) -> None:
        self.simulated_ns: int | None = None

    def now(self) -> Time:
        """The time; 0 with simulated time before the first /clock."""
        return Time(time.time_ns() if self.simulated_ns is None else self.simulated_ns)

    def timer_ns(self) -> int:
        """What timers count on: simulated time, else the steady clock [ns]."""
        return time.monotonic_ns() if self.simulated_ns is None else self.simulated_ns


class Timer:
    """Calls back each period; periods missed altogether are skipped.

    Args:
        period_ns: period [ns].
        callback: called without arguments in the spinning thread.
        clock: the node's clock.
    """

    def __init__(self, period_ns: int, callback: Any, clock: Clock) -> None:
        self.timer_period_ns = period_ns
        self.callback = callback
        self._clock = clock
        self._canceled = False
        self.reset()

    @property
    def simulated(self) -> bool:
        """Whether it follows /clock."""
        return self._clock.simulated_ns is not None

    def remaining_ns(self) -> int:
        """Time until it is due [ns], 0 or less when it is."""
        return self._next - self._clock.timer_ns()

    def is_canceled(self) -> bool:
        """Whether it was cancelled."""
        return self._canceled

    def cancel(self) -> None:
        """Stop calling back until `reset`."""
        self._canceled = True

    def reset(self) -> None:
        """Start counting from now."""
        self._canceled = False
        self._next = self._clock.timer_ns() + self.timer_period_ns

    def call_if_due(self) -> bool:
        """Call back if it is due; whether it was."""
        late = -self.remaining_ns()
        if self._canceled or late < 0:
            return False
        periods = 1 + late // self.timer_period_ns if self.timer_period_ns else 1
        self._next += periods * self.timer_period_ns
        self.callback()
        return True
