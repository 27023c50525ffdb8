# SPDX-License-Identifier: Apache-2.0
"""A bus of Feetech servos (STS series) through Feetech's SDK."""

from __future__ import annotations

from scservo_sdk import PortHandler, protocol_packet_handler

from leo_sim.drivers.servo_line import Limits, ServoLine


class _Port(Limits, PortHandler):
    """The SDK's port."""


class _Packets(protocol_packet_handler):
    """The SDK's packets.

    Attributes:
        size: how many bytes of data the last status had, which the SDK does not look at.
    """

    size = 0

    def rxPacket(self, port: _Port) -> tuple[list[int], int]:
        """A status packet and whether it is one."""
        packet, result = super().rxPacket(port)
        self.size = len(packet) - 6
        return packet, result


class FeetechBus(ServoLine):
    """Registers of the Feetech servos on one port."""

    family, packets, port = 'feetech', _Packets, _Port

    def set(self, servo: int, name: str, value: int) -> None:
        """Write a register; one that is kept without power only where it differs, unlocked."""
        if not self._registers[name].kept:
            super().set(servo, name, value)
        elif self.get(servo, name) != value:
            super().set(servo, 'lock', 0)
            super().set(servo, name, value)
            super().set(servo, 'lock', 1)
