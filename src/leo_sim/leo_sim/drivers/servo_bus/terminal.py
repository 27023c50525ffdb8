# SPDX-License-Identifier: Apache-2.0
"""A pseudo-terminal with a rig behind it, in real time."""

from __future__ import annotations

import os
from pathlib import Path
import select
from threading import Event
import tty

from leo_msgs_py.errors import UserError
from leo_sim.drivers.computer import Computer, THIS
from leo_sim.drivers.servo_bus.line import Line
from leo_sim.drivers.servo_bus.plant import Plant, SLICE
from leo_sim.drivers.servo_bus.rig import Rig

GIVE_UP = 0.05
"""When this process was kept waiting longer than this [s], no time passed for robot and servos:
what was sent meanwhile has not come late, and no watchdog expires."""

STALL = 0.02
"""A wait longer than this [s] is logged: motors that were driven meanwhile were so for us."""


class Terminal(Rig):
    """A rig that carries its bytes over a pseudo-terminal.

    Args:
        plant: the robot with its servos.
        line: what the bytes go through.
        link: where the port can be opened, a symbolic link; '' makes none.
        log: as a rig's, with `time late seconds` each time this process was kept waiting.
        computer: whose time it is.

    Attributes:
        port: path of the pseudo-terminal; '' while the cable is out of the computer.
    """

    def __init__(
        self, plant: Plant, line: Line, link: str = '', log: str = '', computer: Computer = THIS
    ) -> None:
        super().__init__(plant, line, log)
        self.port = ''
        self._link = Path(link) if link else None
        self._ends: tuple[int, ...] = ()
        self._looked = 0.0
        self._computer = computer
        self.began = computer.monotonic()
        self.plug()

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
            self.step()
        self.unplug()

    def step(self) -> None:
        """Carry what has come, waiting for it at most a slice, and what is answered."""
        data = self._bytes()
        now = self._now()
        for due, answer in self.serve(data, now):
            self._send(answer, due)
        self._looked = max(now, self.plant.seconds)

    def _now(self) -> float:
        """Time since the start [s], less what was not caught up."""
        now = self._computer.monotonic() - self.began
        late = now - self._looked
        if late > STALL:
            self._log_line(now, f'late {late:.6f}')
        if late > GIVE_UP:
            self.began += late
            now = self._looked
        return now

    def _bytes(self) -> bytes:
        """What the computer has sent."""
        if not self._ends:
            self._computer.sleep(SLICE)
            return b''
        ready, _, _ = select.select(self._ends[:1], [], [], SLICE)
        return os.read(self._ends[0], 4096) if ready else b''

    def _send(self, answer: bytes, due: float) -> None:
        if answer and self._ends:
            self._computer.sleep(max(0.0, due - (self._computer.monotonic() - self.began)))
            os.write(self._ends[0], answer)


def _point(link: Path, target: str) -> None:
    try:
        link.unlink(missing_ok=True)
        link.symlink_to(target)
    except OSError as error:
        raise UserError(f'cannot make the link {link}: {error.strerror}') from error
