# SPDX-License-Identifier: Apache-2.0
"""Packets that were lost or damaged on the way to a robot: counted, and borne a few in a row."""

from __future__ import annotations

from leo_sim.drivers.base import DriverFault


class Faults:
    """Count the periods in which the driver failed.

    Args:
        patience: how many in a row are borne.

    Attributes:
        total: how many there were.
        in_a_row: how many of them end with the last period.
        last: what the last one said.
    """

    def __init__(self, patience: int) -> None:
        self._patience = patience
        self.total = self.in_a_row = self._told = 0
        self.last = ''

    def note(self, why: str) -> None:
        """A period is over; `why` says what failed in it, nothing if all went well.

        Raises:
            DriverFault: more in a row than are borne.
        """
        if not why:
            self.in_a_row = 0
            return
        self.total += 1
        self.in_a_row += 1
        self.last = why
        if self.in_a_row > self._patience:
            raise DriverFault(f'{self.in_a_row} periods in a row failed, the last one: {why}')

    def take_new(self) -> int:
        """How many there were since the last call."""
        new, self._told = self.total - self._told, self.total
        return new
