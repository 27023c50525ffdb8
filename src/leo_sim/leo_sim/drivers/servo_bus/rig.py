# SPDX-License-Identifier: Apache-2.0
"""A pseudo-terminal with servos behind it, and a robot behind them, in real time."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
from queue import SimpleQueue
import select
from threading import Event
import time
import tty

from leo_msgs_py.errors import UserError
from leo_sim.drivers.servo_bus import feetech, packets
from leo_sim.drivers.servo_bus.bus import Bus
from leo_sim.drivers.servo_bus.line import Line
from leo_sim.drivers.servo_bus.packets import Reader
from leo_sim.drivers.servo_bus.plant import Plant, SLICE

BUSES: dict[str, tuple[type[Bus], packets.Framing]] = {
    'dynamixel': (Bus, packets.FRAMING),
    'feetech': (feetech.FeetechBus, feetech.FRAMING),
}
DELAY_UNIT = 2e-6
"""s a count of the register return_delay_time."""

SILENCE = 0.002
"""After so long without bytes [s] a packet that has begun is forgotten."""

GIVE_UP = 0.05
"""When this process was kept waiting longer than this [s], no time passed for robot and servos:
what was sent meanwhile has not come late, and no watchdog expires."""

IDLE = 0.02
"""After so long without bytes [s] the robot moves on by itself. Until then it moves where it is
asked: an instruction that waited for a step to be integrated would be heard late."""

STALL = 0.02
"""A wait longer than this [s] is logged: motors that were driven meanwhile were so for us."""


class Rig:
    """Carries bytes between a pseudo-terminal and servos, and moves the robot behind them.

    Args:
        plant: the robot with its servos.
        line: what the bytes go through.
        link: where the port can be opened, a symbolic link; '' makes none.
        log: file that every change of what is on the motors is written to, as lines of the time
            (time.monotonic, s) and the values, NaN where free; and `time late seconds` each time
            this process was kept waiting. '' writes none.

    Attributes:
        port: path of the pseudo-terminal; '' while the cable is out of the computer.
        bus_cable: False while the cable between the computer's adapter and the servos is out.
        packets: how many instructions arrived.
    """

    def __init__(self, plant: Plant, line: Line, link: str = '', log: str = '') -> None:
        self.plant, self._line = plant, line
        kind, self._framing = BUSES[plant.family]
        self.bus = kind({servo.get('id'): servo for servo in plant.servos.values()})
        self.bus_cable = True
        self.port = ''
        self.packets = 0
        self._reader = Reader(self._framing)
        self._link = Path(link) if link else None
        self._log = Path(log) if log else None
        self._said = ''
        self._orders: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._ends: tuple[int, ...] = ()
        self._last_bytes = self._looked = 0.0
        plant.connect()
        self._began = time.monotonic()
        self.plug()

    def order(self, act: Callable[[], None]) -> None:
        """Have the rig's own thread do something between two packets."""
        self._orders.put(act)

    def plug(self) -> None:
        """Put the cable into the computer: a new port."""
        if self._ends:
            return
        self._ends = os.openpty()
        tty.setraw(self._ends[1])
        self.port = os.ttyname(self._ends[1])
        if self._link is not None:
            _point(self._link, self.port)

    def unplug(self) -> None:
        """Pull the cable out of the computer: the port is gone."""
        ends, self._ends, self.port = self._ends, (), ''
        for end in ends:
            os.close(end)
        if self._link is not None:
            self._link.unlink(missing_ok=True)

    def run(self, ended: Event) -> None:
        """Serve until `ended` is set."""
        while not ended.is_set():
            data = self._bytes()
            now = self._now()
            self._obey(now)
            if data:
                self._hear(data, now)
            elif now - self._last_bytes > IDLE:
                self._go_on(max(now, self.plant.seconds))
            self._looked = max(now, self.plant.seconds)
        self.unplug()

    def _now(self) -> float:
        """Time since the start [s], less what was not caught up."""
        now = time.monotonic() - self._began
        late = now - self._looked
        if late > STALL:
            self._log_line(now, f'late {late:.6f}')
        if late > GIVE_UP:
            self._began += late
            now = self._looked
        return now

    def _obey(self, now: float) -> None:
        while not self._orders.empty():
            self._go_on(max(now, self.plant.seconds))
            self._orders.get_nowait()()

    def _bytes(self) -> bytes:
        """What the computer has sent, waiting for it at most a slice."""
        if not self._ends:
            time.sleep(SLICE)
            return b''
        ready, _, _ = select.select(self._ends[:1], [], [], SLICE)
        return os.read(self._ends[0], 4096) if ready else b''

    def _hear(self, data: bytes, now: float) -> None:
        """Take bytes in and send back what the servos answer, when it is due.

        Where instructions have piled up this process was late, not the servos: no more waiting.
        """
        if not self.bus_cable:
            return
        if now - self._last_bytes > SILENCE:
            self._reader.clear()
        heard, late = self._line.carried(data)
        due = now + late + self._line.seconds(len(data))
        self._last_bytes = due
        found = self._reader.feed(heard)
        for packet in found:
            self.packets += 1
            self._go_on(due)
            statuses = self.bus.answer(packet, due)
            self._write_down(due)
            for status in statuses:
                carried, late = self._line.carried(status)
                due += late + self._line.seconds(len(status)) + self._return_delay(status)
                self._send(carried, due if len(found) == 1 else now)

    def _return_delay(self, status: bytes) -> float:
        servo = self.bus.servos.get(status[self._framing.id_at])
        return servo.get('return_delay_time') * DELAY_UNIT if servo else 0.0

    def _send(self, answer: bytes, due: float) -> None:
        if answer and self._ends:
            time.sleep(max(0.0, due - (time.monotonic() - self._began)))
            os.write(self._ends[0], answer)

    def _go_on(self, seconds: float) -> None:
        """Move the robot and the servos' watchdogs up to a time [s]."""
        self.plant.run_to(seconds)
        self.bus.watch(seconds)
        self._write_down(seconds)

    def _write_down(self, seconds: float) -> None:
        """Log what is on the motors where it has changed."""
        if self._log is None:
            return
        self.plant.drive()
        said = ' '.join(f'{value:.6g}' for value in self.plant.volts)
        if said != self._said:
            self._said = said
            self._log_line(seconds, said)

    def _log_line(self, seconds: float, text: str) -> None:
        if self._log is not None:
            with self._log.open('a') as file:
                file.write(f'{self._began + seconds:.6f} {text}\n')


def _point(link: Path, target: str) -> None:
    try:
        link.unlink(missing_ok=True)
        link.symlink_to(target)
    except OSError as error:
        raise UserError(f'cannot make the link {link}: {error.strerror}') from error
