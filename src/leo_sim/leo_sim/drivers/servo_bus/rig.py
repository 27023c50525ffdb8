# SPDX-License-Identifier: Apache-2.0
"""Servos and the robot behind them: what they answer to bytes, and when, at times that are given.

Whoever carries the bytes brings the time: `terminal.py` that of the wall.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from queue import SimpleQueue

from leo_sim.drivers.servo_bus import feetech, packets
from leo_sim.drivers.servo_bus.bus import Bus
from leo_sim.drivers.servo_bus.line import Line
from leo_sim.drivers.servo_bus.packets import Reader
from leo_sim.drivers.servo_bus.plant import Plant

BUSES: dict[str, tuple[type[Bus], packets.Framing]] = {
    'dynamixel': (Bus, packets.FRAMING),
    'feetech': (feetech.FeetechBus, feetech.FRAMING),
}
DELAY_UNIT = 2e-6
"""s a count of the register return_delay_time."""

SILENCE = 0.002
"""After so long without bytes [s] a packet that has begun is forgotten."""

IDLE = 0.02
"""After so long without bytes [s] the robot moves on by itself. Until then it moves where it is
asked: an instruction that waited for a step to be integrated would be heard late."""


class Rig:
    """What is at the other end of the computer's cable.

    Args:
        plant: the robot with its servos.
        line: what the bytes go through.
        log: file that every change of what is on the motors is written to, as lines of the time
            (`began` added, s) and the values, NaN where free. '' writes none.

    Attributes:
        bus_cable: False while the cable between the computer's adapter and the servos is out.
        packets: how many instructions arrived.
        began: the computer's time [s] when that of the rig was 0.
    """

    def __init__(self, plant: Plant, line: Line, log: str = '') -> None:
        self.plant, self._line = plant, line
        kind, self._framing = BUSES[plant.family]
        self.bus = kind({servo.get('id'): servo for servo in plant.servos.values()})
        self.bus_cable = True
        self.packets = 0
        self.began = 0.0
        self._reader = Reader(self._framing)
        self._log = Path(log) if log else None
        self._said = ''
        self._orders: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._last_bytes = 0.0
        plant.connect()

    def order(self, act: Callable[[], None]) -> None:
        """Have something done between two packets, by the thread that serves."""
        self._orders.put(act)

    def serve(self, data: bytes, now: float) -> Iterator[tuple[float, bytes]]:
        """Go on up to time `now` [s] and hear bytes; the answers, and when each is due [s]."""
        self._obey(now)
        if data:
            yield from self._hear(data, now)
        elif now - self._last_bytes > IDLE:
            self._go_on(max(now, self.plant.seconds))

    def _obey(self, now: float) -> None:
        while not self._orders.empty():
            self._go_on(max(now, self.plant.seconds))
            self._orders.get_nowait()()

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
            self.packets += 1
            self._go_on(due)
            statuses = self.bus.answer(packet, due)
            self._write_down(due)
            for status in statuses:
                carried, late = self._line.carried(status)
                due += late + self._line.seconds(len(status)) + self._return_delay(status)
                yield due if len(found) == 1 else now, carried

    def _return_delay(self, status: bytes) -> float:
        servo = self.bus.servos.get(status[self._framing.id_at])
        return servo.get('return_delay_time') * DELAY_UNIT if servo else 0.0

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
                file.write(f'{self.began + seconds:.6f} {text}\n')
