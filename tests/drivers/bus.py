# SPDX-License-Identifier: Apache-2.0
"""An emulated bus in this process, with a robot of the tests' own behind it.

`running` is a bus on a clock of its own, which is its driver's too: nothing waits for the wall,
and nothing depends on how busy the machine is. `at_terminal` is one on a pseudo-terminal, in real
time, for what needs a real port.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import re
import shutil
from threading import Event, RLock, Thread

from tests.drivers.clock import Clock

from leo_sim.description.robot import load_robot, Robot
from leo_sim.drivers import load_driver
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.servo_bus.line import Line, Trouble
from leo_sim.drivers.servo_bus.plant import Plant
from leo_sim.drivers.servo_bus.rig import Rig, Terminal
from leo_sim.drivers.servo_driver import ServoDriver

BUSES = {'dynamixel': 'dynamixel:\n    watchdog: {value: 2, unit: s}', 'feetech': 'feetech:'}
STEP, LONG = 0.002, 60.0  # how far time goes between two looks, and how far at most [s]

SERVO = """\
driver:
  {bus}
    servos:
      pivot: {{id: 1, model: {model}{more}}}
"""


class Wired(Clock):
    """A computer with a rig at its only port.

    Attributes:
        descriptor: of the port, for other processes, which no rig hears.
    """

    descriptor = os.open(os.devnull, os.O_WRONLY)

    def __init__(self, rig: Rig):
        super().__init__()
        self.rig = rig
        self.lock = RLock()
        """A driver halts from another thread."""

    def serial(self, path: str, baud: int, wait: float) -> 'Wire':
        return Wire(self, wait)

    def serve(self, data: bytes = b'') -> list[tuple[float, bytes]]:
        with self.lock:
            return list(self.rig.serve(data, self.monotonic()))


class Wire:
    """What is used of a serial port; looking for bytes takes the computer's time alone."""

    def __init__(self, computer: Wired, wait: float):
        self._computer, self._wait = computer, wait
        self._coming: list[tuple[float, bytes]] = []

    def write(self, data: bytes) -> int:
        with self._computer.lock:
            self._coming += self._computer.serve(bytes(data))
        return len(data)

    def read(self, size: int) -> bytes:
        with self._computer.lock:
            if not self.in_waiting:
                due = self._coming[0][0] if self._coming else float('inf')
                self._computer.sleep(min(self._wait, due - self._computer.monotonic()))
            come = self._take()
            if come[size:]:
                self._coming.insert(0, (self._computer.monotonic(), come[size:]))
            return come[:size]

    @property
    def in_waiting(self) -> int:
        now = self._computer.monotonic()
        return sum(len(data) for due, data in self._coming if due <= now)

    def reset_input_buffer(self) -> None:
        self._take()

    def fileno(self) -> int:
        return self._computer.descriptor

    def close(self) -> None:
        self._coming = []

    def _take(self) -> bytes:
        now = self._computer.monotonic()
        come = b''.join(data for due, data in self._coming if due <= now)
        self._coming = [(due, data) for due, data in self._coming if due > now]
        return come


class Emulated(Rig):
    """A rig at a computer of its own."""

    port = '/emulated'

    def __init__(self, plant: Plant, line: Line):
        super().__init__(plant, line)
        self.computer = Wired(self)

    def until(self, what, why: str = '') -> None:
        """Let time pass until something is so."""
        end = self.computer.monotonic() + LONG
        while not what():
            assert self.computer.monotonic() < end, why
            self.computer.sleep(STEP)
            self.computer.serve()


def robot_with_servo(
    folder: Path,
    like: str,
    model: str,
    family: str = 'dynamixel',
    period: float = 0.05,
    **more: object,
) -> Robot:
    """A robot with one joint, like a shipped one but slow, on a servo with these figures."""
    made = folder / f'{like}_{model}'
    shutil.copytree(load_robot(like).folder, made, dirs_exist_ok=True)
    path = made / 'robot.yaml'
    path.chmod(0o644)
    text = path.read_text().split('\ndriver:')[0].rstrip('\n')
    text = re.sub(r'control_period: \S+', f'control_period: {period:g}', text)
    text = re.sub(r'state_rate: \S+', f'state_rate: {1 / period:g}', text)
    figures = ''.join(f', {key}: {value}' for key, value in more.items())
    path.write_text(f'{text}\n\n{SERVO.format(bus=BUSES[family], model=model, more=figures)}')
    return load_robot(made)


def running(robot: Robot, supply: float = 12.0, start: str = 'nominal') -> Emulated:
    """A bus at work on a clock of its own."""
    return Emulated(_plant(robot, supply, start), Line(robot.driver.bus.baud, Trouble(), seed=1))


@contextmanager
def at_terminal(robot: Robot, supply: float = 12.0, start: str = 'nominal') -> Iterator[Terminal]:
    """A bus at work in real time; its line has no baud rate to wait for."""
    rig, ended = Terminal(_plant(robot, supply, start), Line(1e9, Trouble(), seed=1)), Event()
    thread = Thread(target=rig.run, args=(ended,))
    thread.start()
    try:
        yield rig
    finally:
        ended.set()
        thread.join()


def _plant(robot: Robot, supply: float, start: str) -> Plant:
    return Plant(DriverOptions(robot, start=start, engine='rigid'), supply, 0.0)


def options(robot: Robot, rig: Emulated) -> DriverOptions:
    """Of a driver at the rig's computer."""
    return DriverOptions(robot, port=rig.port, computer=rig.computer)


@contextmanager
def driven(robot: Robot, rig: Emulated) -> Iterator[ServoDriver]:
    """A driver connected to it."""
    driver = load_driver(robot.driver.family, options(robot, rig))
    driver.connect()
    try:
        yield driver
    finally:
        driver.stop()
