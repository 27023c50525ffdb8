# SPDX-License-Identifier: Apache-2.0
"""A bus of Dynamixel servos through ROBOTIS' SDK."""

from __future__ import annotations

from dynamixel_sdk import PortHandler, Protocol2PacketHandler

from leo_sim.drivers.servo_line import Limits, ServoLine

STUFFED, PLAIN = b'\xff\xff\xfd\xfd', b'\xff\xff\xfd'


class _Port(Limits, PortHandler):
    """The SDK's port."""


class _Packets(Protocol2PacketHandler):
    """The SDK's packets; its own removal of stuffing mistakes FF FF FD FF FD FD.

    Attributes:
        size: how many bytes of data the last status had, which the SDK does not look at.
    """

    size = 0

    def removeStuffing(self, packet: list[int]) -> list[int]:
        """A status packet as it was before it was stuffed."""
        body = bytes(packet[7:-2]).replace(STUFFED, PLAIN)
        self.size = len(body) - 2
        length = list((len(body) + 2).to_bytes(2, 'little'))
        return [*packet[:5], *length, *body, *packet[-2:]]


class DynamixelBus(ServoLine):
    """Registers of the Dynamixel servos on one port."""

    family, packets, port = 'dynamixel', _Packets, _Port
    asks = (False,)  # no fast sync read, which not all models know
