# SPDX-License-Identifier: Apache-2.0
"""A bus of servos through their maker's SDK: registers by name, all servos at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
import termios
from typing import Any, ClassVar

from leo_msgs_py.errors import UserError
from leo_sim.description.servos import Family, Register, registers
from leo_sim.drivers.base import DriverFault, TransientFault
from leo_sim.drivers.computer import Computer, THIS

CONFIGURE = 0.1
"""How long an answer may take while nothing moves [s]."""

TRIES = 3
"""How often an instruction to one servo is sent before it counts as unanswered."""

POLL = 0.0005
"""How long one look for bytes waits [s]; the SDK alone looks without a pause."""

RUBBISH = 5.0
"""Whatever still comes after so many times the time of an answer is none."""

BITS = 10
"""Of a byte on the bus, with its start and stop bit."""

COMM_SUCCESS, COMM_RX_CORRUPT = 0, -3002
"""Results of an SDK: success of both, and one that is none."""


class Limits:
    """What a port of an SDK is mixed with.

    A time limit of ours, a clock that nobody sets, and an end to rubbish.

    Attributes:
        computer: whose port it is.
        slack: time an answer may take on top of that of its bytes [s].
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

    def setupPort(self, baud: int) -> bool:
        """Open the port."""
        self.ser = self.computer.serial(self.port_name, baud, POLL)
        self.tx_time_per_byte = 1e3 * BITS / baud
        self.is_open = True
        return True

    def getCurrentTime(self) -> float:
        """Time in ms."""
        return self.computer.monotonic() * 1e3

    def setPacketTimeout(self, packet_length: int) -> None:
        """Wait for an answer of so many bytes."""
        self.setPacketTimeoutMillis(self.tx_time_per_byte * packet_length + 1e3 * self.slack)

    def clearPort(self) -> None:
        """Forget bytes that have come.

        Raises:
            OSError: the port is gone.
        """
        try:
            self.ser.reset_input_buffer()
        except termios.error as error:
            raise OSError(*error.args) from error

    def readPort(self, length: int) -> bytes:
        """Bytes that have come, waiting a little for the first."""
        if self.packet_timeout and self.getTimeSinceStart() > RUBBISH * self.packet_timeout:
            raise TransientFault('no whole answer came in time')
        return bytes(self.ser.read(length))


class _Paper:
    """A port that keeps what is written, to send it later."""

    is_using = False
    written = b''

    def clearPort(self) -> None:
        """Nothing to clear."""

    def setPacketTimeout(self, packet_length: int) -> None:
        """Nobody answers."""

    def writePort(self, packet: Sequence[int]) -> int:
        """Keep a packet."""
        self.written = bytes(packet)
        return len(packet)


class ServoLine:
    """Registers of the servos on one port; what an SDK has of its own is in the subclasses.

    Args:
        path: of the port.
        baud: bits a second.
        names: of the servos, by id, for what is said of them.
        computer: whose port it is.
    """

    family: ClassVar[Family]
    packets: ClassVar[type]
    """The SDK's packet handler; its `size` is how many bytes of data the last status had."""
    port: ClassVar[type]
    """The SDK's port, mixed with Limits."""
    asks: ClassVar[tuple[bool, ...]] = ()
    """What the SDK wants to be told besides when all are asked."""

    def __init__(
        self, path: str, baud: int, names: Mapping[int, str], computer: Computer = THIS
    ) -> None:
        self._path, self._baud, self._names, self._computer = path, baud, names, computer
        self._registers = registers(self.family)
        self._packets: Any = self.packets()
        self._port: Any = None

    def open(self) -> None:
        """Open the port for this process alone.

        Raises:
            UserError: there is none, it is not ours to open, or not at this baud rate.
        """
        port: Any = self.port(self._path)
        port.computer, port.slack = self._computer, CONFIGURE
        try:
            opened = port.setBaudRate(self._baud)
        except OSError as error:
            raise UserError(f'cannot open {self._path}: {_reason(self._path, error)}') from error
        if not opened:
            raise UserError(
                f'the port cannot do {self._baud} baud; give another in robot.yaml, '
                f'driver: {self.family}: baud, and set the servos to it'
            )
        self._port = port

    def close(self) -> None:
        """Close the port; safe to call twice."""
        if self._port is not None:
            port, self._port = self._port, None
            port.closePort()

    @property
    def is_open(self) -> bool:
        """Whether there is a port."""
        return self._port is not None

    @property
    def descriptor(self) -> int:
        """File descriptor of the port."""
        number: int = self._port.ser.fileno()
        return number

    def wait_at_most(self, slack: float) -> None:
        """Let an answer take so long [s] on top of the time of its bytes."""
        self._port.slack = slack

    def ping(self, servo: int) -> int | None:
        """The model number of a servo; None where none answers."""
        try:
            return int(self._asked(servo, 'its model', lambda: self._pinged(servo))[0])
        except TransientFault:
            return None

    def get(self, servo: int, name: str) -> int:
        """The value of a register."""
        register = self._registers[name]
        at, size = register.address, register.size
        found, _ = self._asked(
            servo,
            name,
            lambda: self._whole(size, *self._packets.readTxRx(self._port, servo, at, size)),
        )
        return register.decode(bytes(found))

    def set(self, servo: int, name: str, value: int) -> None:
        """Write a register; one that is kept without power only where it differs.

        Raises:
            DriverFault: the servo refuses it.
        """
        register = self._registers[name]
        if register.kept and self.get(servo, name) == value:
            return
        _, error = self._asked(
            servo,
            name,
            lambda: (
                None,
                *self._packets.writeTxRx(
                    self._port,
                    servo,
                    register.address,
                    register.size,
                    list(register.encode(value)),
                ),
            ),
        )
        if error & 0x7F:
            raise DriverFault(
                f'{self._who(servo)} refuses {name} {value}: '
                f'{self._packets.getRxPacketError(error)}'
            )

    def earlier(self, one: str, other: str) -> str:
        """The register of two that comes first; '' is none."""
        return min(filter(None, (one, other)), key=lambda name: self._registers[name].address)

    def sync_read(
        self, servos: Sequence[int], first: str, last: str
    ) -> tuple[float, dict[int, Block]]:
        """All registers from `first` to `last` of all servos, with one instruction.

        Returns:
            When all of it was sent, as of the computer's monotonic time [s], and what each servo
            answered.

        Raises:
            TransientFault: an answer is missing or damaged.
        """
        start = self._registers[first].address
        length = self._registers[last].end - start
        self._port.is_using = False
        asked = start, length, list(servos), len(servos), *self.asks
        paper = _Paper()
        self._packets.syncReadTx(paper, *asked)
        result = self._packets.syncReadTx(self._port, *asked)
        sent = self._computer.monotonic() + self.seconds(len(paper.written))
        self._check(result, servos[0])
        found = {}
        for servo in servos:
            data, result, error = self._whole(
                length, *self._packets.readRx(self._port, servo, length)
            )
            self._check(result, servo)
            found[servo] = Block(start, bytes(data), error, self._registers)
        return sent, found

    def seconds(self, count: int) -> float:
        """How long so many bytes are on their way [s]."""
        return count * BITS / self._baud

    def sync_write(self, name: str, values: Mapping[int, int]) -> None:
        """Write a register of several servos with one instruction, which nobody answers."""
        self.send(self.packet(name, values))

    def packet(self, name: str, values: Mapping[int, int]) -> bytes:
        """The bytes of such an instruction."""
        register, paper = self._registers[name], _Paper()
        row = [
            byte for servo, value in values.items() for byte in (servo, *register.encode(value))
        ]
        self._packets.syncWriteTxOnly(paper, register.address, register.size, row, len(row))
        return paper.written

    def send(self, data: bytes) -> None:
        """Put bytes on the bus, whatever another thread waits for there.

        Raises:
            OSError: the port is gone.
        """
        if self._port is None:
            raise OSError(f'{self._path} is closed')
        self._port.ser.write(data)

    def _whole(self, size: int, data: Any, result: int, error: int) -> tuple[Any, int, int]:
        """An answer, corrupt where it is that to another question, of another length."""
        if result == COMM_SUCCESS and self._packets.size != size:
            return data, COMM_RX_CORRUPT, error
        return data, result, error

    def _pinged(self, servo: int) -> tuple[int, int, int]:
        number, result, error = self._packets.ping(self._port, servo)
        return number, result, error

    def _asked(self, servo: int, what: str, ask: Any) -> tuple[Any, int]:
        """Answer and error of an instruction to one servo, which may be repeated."""
        for _ in range(TRIES):
            self._port.is_using = False
            answer, result, error = ask()
            if result == COMM_SUCCESS:
                return answer, error
        raise TransientFault(f'{self._who(servo)} does not answer when asked for {what}')

    def _check(self, result: int, servo: int) -> None:
        if result != COMM_SUCCESS:
            self._port.is_using = False
            said = self._packets.getTxRxResult(result).split('] ')[-1].rstrip('!')
            raise TransientFault(f'{self._who(servo)}: {said}')

    def _who(self, servo: int) -> str:
        return f'servo {servo} ({self._names[servo]})'


class Block:
    """Neighbouring registers of one servo, as read at once.

    Args:
        start: address of the first byte.
        data: the bytes.
        error: of the status they came with.
        table: all registers by name.
    """

    def __init__(self, start: int, data: bytes, error: int, table: Mapping[str, Register]) -> None:
        self._start, self._data, self._table = start, data, table
        self.error = error

    def get(self, name: str) -> int:
        """The value of a register in it."""
        register = self._table[name]
        at = register.address - self._start
        return register.decode(self._data[at : at + register.size])


def latency_timer(path: str) -> int | None:
    """How long a USB adapter keeps bytes back [ms]; None where the port has no such timer."""
    name = Path(path).resolve().name
    file = Path(f'/sys/bus/usb-serial/devices/{name}/latency_timer')
    try:
        return int(file.read_text())
    except (OSError, ValueError):
        return None


def _reason(path: str, error: OSError) -> str:
    if not Path(path).exists():
        return 'there is no such port; is the adapter plugged in? (-p port:=, or robot.yaml)'
    if isinstance(error.__context__, BlockingIOError) or error.errno == 11:
        return 'another program has it open'
    if error.errno == 13:
        return 'permission denied; be in the group dialout'
    return str(error)
