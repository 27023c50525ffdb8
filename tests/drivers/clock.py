# SPDX-License-Identifier: Apache-2.0
"""A computer whose time passes only where somebody waits for it, however busy the machine is."""

from leo_sim.drivers.base import Computer

EPOCH = 1_700_000_000_000_000_000  # the wall's time [ns] when its monotonic time is 0


class Clock(Computer):
    """Time alone, no ports."""

    def __init__(self):
        self._now = 0.0

    def monotonic(self):
        return self._now

    def time_ns(self):
        return EPOCH + round(1e9 * self._now)

    def sleep(self, seconds):
        self._now += max(0.0, seconds)
