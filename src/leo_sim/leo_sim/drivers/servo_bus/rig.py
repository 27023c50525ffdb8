# SPDX-License-Identifier: Apache-2.0
"""Servos and the robot behind them: what they answer to bytes, and when.

A Rig is given the time; a Terminal is a rig on a pseudo-terminal, in real time.
"""

from collections.abc import Callable, Iterator
import os
from pathlib import Path
from queue import SimpleQueue
import select
from threading import Event
import tty

from leo_msgs_py.errors import UserError
from leo_sim.drivers.base import Computer, THIS
from leo_sim.drivers.listening import tell
from leo_sim.drivers.servo_bus import dynamixel, feetech
from leo_sim.drivers.servo_bus.line import Framing, Line, Reader
from leo_sim.drivers.servo_bus.plant import Plant, SLICE

BUSES: dict[str, tuple[type[dynamixel.Bus], Framing]] = {
    'dynamixel': (dynamixel.Bus, dynamixel.FRAMING),
    'feetech': (feetech.FeetechBus, feetech.FRAMING),
}
DELAY_UNIT = 2e-6  # s a count of the register return_delay_time
SILENCE = 0.002  # after so long without bytes [s] a packet that has begun is forgotten
IDLE = 0.02
"""After so long without bytes [s] the robot moves on by itself. Until then it moves where it is
asked: an instruction that waited for a step to be integrated would be heard late."""
GIVE_UP = 0.05
"""When this process was kept waiting longer than this [s], no time passed for robot and servos:
what was sent meanwhile has not come late, and no watchdog expires."""
STALL = 0.02
"""A wait longer than this [s] is logged: motors that were driven meanwhile were so for us."""


class Rig:
    """What is at the other end of the computer's cable.

    Every change of what is on the motors is written to the file `log`, as lines of the time
    (`began` added, s) and the values, NaN where free. '' writes none.
    """

    def __init__(self, plant: Plant, line: Line, log: str = '') -> None:
        self.plant, self._line = plant, line
        kind, self._framing = BUSES[plant.family]
        self.bus = kind({servo.get('id'): servo for servo in plant.servos.values()})
        self.bus_cable = True
        self.began = 0.0
        self._reader = Reader(self._framing)
        self._log = Path(log) if log else None
        self._said = ''
        self._orders: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._last_bytes = 0.0
        plant.connect()

    def order(self, act: Callable[[], None]) -> None:
        self._orders.put(act)

    def serve(self, data: bytes, now: float) -> Iterator[tuple[float, bytes]]:
        """Go on up to time `now` [s] and hear bytes; the answers, and when each is due [s]."""
        while not self._orders.empty():
            self._go_on(max(now, self.plant.seconds))
            self._orders.get_nowait()()
        if data:
            yield from self._hear(data, now)
        elif now - self._last_bytes > IDLE:
            self._go_on(max(now, self.plant.seconds))

    def _hear(self, data: bytes, now: float) -> Iterator[tuple[float, bytes]]:
        """What the servos answer, when it is due.

        Where instructions have piled up whoever serves was late, not the servos: no more waiting.
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
            self._go_on(due)
            statuses = self.bus.answer(packet, due)
            self._write_down(due)
            for status in statuses:
                carried, late = self._line.carried(status)
                servo = self.bus.servos.get(status[self._framing.id_at])
                delay = servo.get('return_delay_time') * DELAY_UNIT if servo else 0.0
                due += late + self._line.seconds(len(status)) + delay
                yield due if len(found) == 1 else now, carried

    def _go_on(self, seconds: float) -> None:
        self.plant.run_to(seconds)
        self.bus.watch(seconds)
        self._write_down(seconds)

    def _write_down(self, seconds: float) -> None:
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
                file.write(f'{self.began + seconds:.6f} {text}\n')


class Terminal(Rig):
    """A rig that carries its bytes over a pseudo-terminal, `port`; '' while the cable is out.

    The port can be opened at the symbolic `link`; '' makes none. The log, as a rig's, also has
    `time late seconds` each time this process was kept waiting.
    """

    def __init__(
        self, plant: Plant, line: Line, link: str = '', log: str = '', computer: Computer = THIS
    ) -> None:
        super().__init__(plant, line, log)
        self.port = ''
        self._link = Path(link) if link else None
        self._ends: tuple[int, ...] = ()
        self._looked = self._listened = 0.0
        self._computer = computer
        self.began = self._last = computer.monotonic()
        self.plug()

    def plug(self) -> None:
        if self._ends:
            return
        self._ends = os.openpty()
        tty.setraw(self._ends[1])
        tell(self._ends[0], self._listened)
        self.port = os.ttyname(self._ends[1])
        if self._link is not None:
            try:
                self._link.unlink(missing_ok=True)
                self._link.symlink_to(self.port)
            except OSError as error:
                raise UserError(f'cannot make the link {self._link}: {error.strerror}') from error

    def unplug(self) -> None:
        ends, self._ends, self.port = self._ends, (), ''
        for end in ends:
            os.close(end)
        if self._link is not None:
            self._link.unlink(missing_ok=True)

    def run(self, ended: Event) -> None:
        while not ended.is_set():
            self.step()
        self.unplug()

    def step(self) -> None:
        """Carry what has come, waiting for it at most a slice, and what is answered."""
        data = self._bytes()
        now = self._now()
        for due, answer in self.serve(data, now):
            if answer and self._ends:
                self._wait_until(due)
                os.write(self._ends[0], answer)
        self._looked = max(now, self.plant.seconds)
        self._listen()

    def _wait_until(self, due: float) -> None:
        while (left := due - (self._computer.monotonic() - self.began)) > 0.0:
            self._computer.sleep(min(left, SLICE))
            self._listen()

    def _listen(self) -> None:
        """Tell the computer how long the servos have listened; answers are out by then.

        Of a time in which this process was kept waiting no more than a slice counts.
        """
        now = self._computer.monotonic()
        self._listened += min(now - self._last, SLICE)
        self._last = now
        if self._ends:
            tell(self._ends[0], self._listened)

    def _now(self) -> float:
        now = self._computer.monotonic() - self.began
        late = now - self._looked
        if late > STALL:
            self._log_line(now, f'late {late:.6f}')
        if late > GIVE_UP:
            self.began += late
            now = self._looked
        return now

    def _bytes(self) -> bytes:
        if not self._ends:
            self._computer.sleep(SLICE)
            return b''
        ready, _, _ = select.select(self._ends[:1], [], [], SLICE)
        return os.read(self._ends[0], 4096) if ready else b''
