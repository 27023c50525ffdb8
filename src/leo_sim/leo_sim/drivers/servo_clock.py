# SPDX-License-Identifier: Apache-2.0
"""When servos measured, told by their own clocks: a question may reach them late."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from statistics import mean, median

TICKS = 32768
"""A servo's clock counts so many ms and begins anew (realtime_tick, e-Manual of the X series)."""
PER_SECOND = 1e3
KEPT, FEWEST = 64, 16
"""Readings by which the clocks are compared, in each of two halves; before there are so many, a
question counts as heard when it is sent."""
TELLS = 0.3e-3
"""Less than this [s] the clocks of some servos cannot tell, as each counts whole ms."""


class ServoClock:
    """Compares the clocks of servos with ours, each running a little fast or slow.

    Usually a question is heard as soon as it is sent. Where the computer or its adapter held it
    back, the servos' clocks have gone on meanwhile.
    """

    def __init__(self) -> None:
        self._ticks: dict[int, int] = {}
        self._seconds: dict[int, float] = {}
        self._ahead: deque[tuple[float, float]] = deque(maxlen=2 * KEPT)

    def moment(self, sent: float, answered: float, ticks: Mapping[int, int]) -> float:
        """When the servos measured, on our clock [s].

        Args:
            sent: when they were asked, on our clock [s].
            answered: when the last answer was there [s].
            ticks: their clocks, by id [ms]; always of the same servos.
        """
        ahead = sent - self._mean(ticks)
        late = self._usual(sent) - ahead if len(self._ahead) >= FEWEST else 0.0
        self._ahead.append((sent, ahead))
        return min(sent + late, answered) if late > TELLS else sent

    def _mean(self, ticks: Mapping[int, int]) -> float:
        """Mean of the servos' clocks since the first reading [s]."""
        for servo, tick in ticks.items():
            passed = (tick - self._ticks.get(servo, tick)) % TICKS
            self._seconds[servo] = self._seconds.get(servo, 0.0) + passed / PER_SECOND
            self._ticks[servo] = tick
        return mean(self._seconds[servo] for servo in ticks)

    def _usual(self, now: float) -> float:
        """By how much our clock is usually ahead when a question is sent, as of now [s]."""
        pairs = [*self._ahead]
        half = len(pairs) // 2
        (t1, a1), (t2, a2) = (
            (median(t for t, _ in part), median(a for _, a in part))
            for part in (pairs[:half], pairs[half:])
        )
        return a2 + (a2 - a1) * (now - t2) / (t2 - t1)
