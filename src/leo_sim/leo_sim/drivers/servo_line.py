# SPDX-License-Identifier: Apache-2.0
"""A bus of servos through their maker's SDK: registers by name, all servos at once."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from leo_msgs_py.errors import UserError
from leo_sim.description.servos import Family, Register, registers
from leo_sim.drivers.base import Computer, DriverFault, TransientFault
from leo_sim.drivers.listening import told
from leo_sim.drivers.servo_port import BITS, Limits, PacketBuffer, why_closed

CONFIGURE = 0.1  # how long an answer may take while nothing moves [s]
TRIES = 3  # how often an instruction to one servo is sent before it counts as unanswered
COMM_SUCCESS, COMM_RX_CORRUPT = 0, -3002
"""Results of an SDK: success of both, and one that is none."""


@dataclass(frozen=True)
class Block:
    start: int  # address of the first byte
    data: bytes
    error: int  # of the status they came with
    table: Mapping[str, Register]  # all registers by name

    def get(self, name: str) -> int:
        register = self.table[name]
        at = register.address - self.start
        return register.decode(self.data[at : at + register.size])


Blocks = dict[int, Block]  # by the id of a servo


class ServoLine:
    """Registers of the servos on one port; `names` are those of their joints, by id."""

    family: ClassVar[Family]
    packets: ClassVar[type]
    """The SDK's packet handler; its `size` is how many bytes of data the last status had."""
    port: ClassVar[type]  # the SDK's, which gets our Limits
    asks: ClassVar[tuple[bool, ...]] = ()  # further arguments of the SDK's sync read

    def __init__(self, path: str, baud: int, names: Mapping[int, str], computer: Computer) -> None:
        self._path, self._baud, self._names, self._computer = path, baud, names, computer
        self._registers = registers(self.family)
        self._packets: Any = self.packets()
        self._port: Any = None

    def open(self) -> None:
        port: Any = type('Port', (Limits, self.port), {})(self._path)
        port.computer, port.slack = self._computer, CONFIGURE
        try:
            opened = port.setBaudRate(self._baud)
        except OSError as error:
            raise UserError(
                f'cannot open {self._path}: {why_closed(self._path, error)}'
            ) from error
        if not opened:
            raise UserError(
                f'the port cannot do {self._baud} baud; give another in robot.yaml, '
                f'driver: {self.family}: baud, and set the servos to it'
            )
        self._port = port

    def close(self) -> None:
        if self._port is not None:
            port, self._port = self._port, None
            port.closePort()

    @property
    def is_open(self) -> bool:
        return self._port is not None

    @property
    def is_emulated(self) -> bool:
        return told(self.descriptor) > 0.0

    @property
    def descriptor(self) -> int:
        return self._port.ser.fileno()

    def wait_at_most(self, slack: float) -> None:
        self._port.slack = slack

    def ping(self, servo: int) -> int | None:
        try:
            (found,), _ = self._asked(servo, 'its model', self._packets.ping)
        except TransientFault:
            return None
        return int(found)

    def get(self, servo: int, name: str) -> int:
        register = self._registers[name]
        asked = self._packets.readTxRx, register.address, register.size
        (data,), _ = self._asked(servo, name, *asked, size=register.size)
        return register.decode(bytes(data))

    def set(self, servo: int, name: str, value: int) -> None:
        """Write a register, one kept without power only where it differs; DriverFault: refused."""
        register = self._registers[name]
        if register.kept and self.get(servo, name) == value:
            return
        data = list(register.encode(value))
        asked = self._packets.writeTxRx, register.address, len(data), data
        _, error = self._asked(servo, name, *asked)
        if error & 0x7F:
            raise DriverFault(
                f'{self.who(servo)} refuses {name} {value}: '
                f'{self._packets.getRxPacketError(error)}'
            )

    def earlier(self, one: str, other: str) -> str:
        return min(filter(None, (one, other)), key=lambda name: self._registers[name].address)

    def sync_read(self, servos: Sequence[int], first: str, last: str) -> tuple[float, Blocks]:
        """When servos were asked [s], and all registers `first` to `last`, by one instruction."""
        start = self._registers[first].address
        length = self._registers[last].end - start
        self._port.is_using = False
        asked = start, length, list(servos), len(servos), *self.asks
        buffer = PacketBuffer()
        self._packets.syncReadTx(buffer, *asked)
        result = self._packets.syncReadTx(self._port, *asked)
        sent = self._computer.monotonic() + self.seconds(len(buffer.written))
        self._check(result, servos[0])
        found = {}
        for servo in servos:
            data, result, error = self._packets.readRx(self._port, servo, length)
            self._check(self._whole(length, result), servo)
            found[servo] = Block(start, bytes(data), error, self._registers)
        return sent, found

    def seconds(self, count: int) -> float:
        return count * BITS / self._baud

    def sync_write(self, name: str, values: Mapping[int, int]) -> None:
        self.send(self.packet(name, values))

    def packet(self, name: str, values: Mapping[int, int]) -> bytes:
        register, buffer = self._registers[name], PacketBuffer()
        row = [byte for n, value in values.items() for byte in (n, *register.encode(value))]
        self._packets.syncWriteTxOnly(buffer, register.address, register.size, row, len(row))
        return buffer.written

    def send(self, data: bytes) -> None:
        """Put bytes on the bus, whatever another thread waits for there; OSError: no port."""
        if self._port is None:
            raise OSError(f'{self._path} is closed')
        self._port.ser.write(data)

    def _whole(self, size: int, result: int) -> int:
        if result == COMM_SUCCESS and self._packets.size != size:
            return COMM_RX_CORRUPT
        return result

    def _asked(
        self, servo: int, what: str, ask: Callable[..., Any], *args: Any, size: int | None = None
    ) -> tuple[list[Any], int]:
        for _ in range(TRIES):
            self._port.is_using = False
            *answer, result, error = ask(self._port, servo, *args)
            if size is not None:
                result = self._whole(size, result)
            if result == COMM_SUCCESS:
                return answer, error
        raise TransientFault(f'{self.who(servo)} does not answer when asked for {what}')

    def _check(self, result: int, servo: int) -> None:
        if result != COMM_SUCCESS:
            self._port.is_using = False
            said = self._packets.getTxRxResult(result).split('] ')[-1].rstrip('!')
            raise TransientFault(f'{self.who(servo)}: {said}')

    def who(self, servo: int) -> str:
        return f'servo {servo} ({self._names[servo]})'
