# SPDX-License-Identifier: Apache-2.0
"""Serial ports of servos, as their makers' SDKs use them."""

from collections.abc import Callable, Sequence
from pathlib import Path
import termios
from typing import Any

from leo_sim.drivers.base import Computer, TransientFault
from leo_sim.drivers.listening import answering_time

POLL = 0.0005  # how long one look for bytes waits [s]; the SDK alone looks without a pause
RUBBISH = 5  # after so many times the time and the bytes of an answer, what still comes is none
BITS = 10  # of a byte on the bus, with its start and stop bit


class Limits:
    """What a port of an SDK is mixed with: a time limit, a clock nobody sets, an end to rubbish.

    `slack` is the time an answer may take on top of that of its bytes [s].
    """

    ser: Any
    port_name: str
    is_open: bool
    tx_time_per_byte: float
    packet_timeout: float
    setPacketTimeoutMillis: Any
    getTimeSinceStart: Any
    computer: Computer
    slack: float
    _time: Callable[[], float]
    _most = _read = 0  # bytes that may come for the last question, and that came

    def setupPort(self, baud: int) -> bool:
        self.ser = self.computer.serial(self.port_name, baud, POLL)
        self.tx_time_per_byte = 1e3 * BITS / baud
        self._time = answering_time(self.ser.fileno(), self.computer)
        self.is_open = True
        return True

    def getCurrentTime(self) -> float:
        return self._time() * 1e3

    def setPacketTimeout(self, packet_length: int) -> None:
        self._most, self._read = RUBBISH * packet_length, 0
        self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + 1e3 * self.slack)

    def clearPort(self) -> None:
        """Forget bytes that have come; OSError: the port is gone."""
        try:
            self.ser.reset_input_buffer()
        except termios.error as error:
            raise OSError(*error.args) from error

    def readPort(self, length: int) -> bytes:
        over = self.packet_timeout and self.getTimeSinceStart() > RUBBISH * self.packet_timeout
        if over and self._read > self._most:
            raise TransientFault('no whole answer came in time')
        data = bytes(self.ser.read(length))
        self._read += len(data)
        return data


class PacketBuffer:
    is_using = False
    written = b''

    def clearPort(self) -> None:
        """Nothing to clear."""

    def setPacketTimeout(self, packet_length: int) -> None:
        """Nobody answers."""

    def writePort(self, packet: Sequence[int]) -> int:
        self.written = bytes(packet)
        return len(packet)


def latency_file(path: str) -> Path:
    """Where Linux says, and is told, how long the USB adapter of a port keeps bytes back [ms]."""
    return Path('/sys/bus/usb-serial/devices', Path(path).resolve().name, 'latency_timer')


def latency_timer(path: str) -> int | None:
    """How long a USB adapter keeps bytes back [ms]; None where the port has no such timer."""
    try:
        return int(latency_file(path).read_text())
    except (OSError, ValueError):
        return None


def why_closed(path: str, error: OSError) -> str:
    if not Path(path).exists():
        return 'there is no such port; is the adapter plugged in? (-p port:=, or robot.yaml)'
    if isinstance(error.__context__, BlockingIOError) or error.errno == 11:
        return 'another program has it open'
    if error.errno == 13:
        return 'permission denied; be in the group dialout'
    return str(error)
