# SPDX-License-Identifier: Apache-2.0
"""Time of one period on a Dynamixel bus: one sync read of everything and one sync write.

    python benchmarks/bus_cost.py [-n 300]

Computed from the bytes at ten bits each, without return delay and USB; and as the driver's bus
takes it on the emulated line, in this process, on whatever machine this is.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread
import time

import numpy as np

from leo_sim.description.servos import PWM_MODE, registers, servo_model
from leo_sim.drivers.dynamixel import DynamixelBus, DynamixelDriver
from leo_sim.drivers.servo_bus.line import BITS, Line, Trouble
from leo_sim.drivers.servo_bus.rig import Terminal
from leo_sim.drivers.servo_bus.servo import Servo

FIRST, LAST = DynamixelDriver.first, DynamixelDriver.last
ASK, STATUS, GOAL = 14, 11, 2
"""Bytes: an instruction to many without its parameters, a status without its data, a goal."""


class Still:
    """Servos without a robot."""

    def __init__(self, count: int) -> None:
        self.servos = {
            f'joint{n}': Servo(n, servo_model('XM430-W210')) for n in range(1, count + 1)
        }
        for servo in self.servos.values():
            servo.set('return_delay_time', 0)
            servo.set('operating_mode', PWM_MODE)
            servo.set('goal_pwm', 0)
        self.family = 'dynamixel'
        self.seconds, self.volts = 0.0, ()

    def connect(self) -> None:
        """Nothing to compile."""

    def drive(self) -> None:
        """Nothing to drive."""

    def run_to(self, seconds: float) -> None:
        """Time passes."""
        self.seconds = seconds


def computed(count: int, baud: float) -> float:
    """Ms that the bytes of a period take."""
    block = registers()[LAST].end - registers()[FIRST].address
    read = ASK + count + count * (STATUS + block)
    return 1e3 * (read + ASK + count * (1 + GOAL)) * BITS / baud


@contextmanager
def at_work(count: int, baud: float) -> Iterator[DynamixelBus]:
    """A bus on an emulated line."""
    rig, ended = Terminal(Still(count), Line(baud, Trouble())), Event()
    thread = Thread(target=rig.run, args=(ended,))
    thread.start()
    bus = DynamixelBus(rig.port, int(baud), dict.fromkeys(range(1, count + 1), ''))
    bus.open()
    try:
        yield bus
    finally:
        bus.close()
        ended.set()
        thread.join()


def emulated(count: int, baud: float, periods: int) -> np.ndarray:
    """Ms of each period."""
    ids, times = list(range(1, count + 1)), []
    with at_work(count, baud) as bus:
        for _ in range(periods):
            began = time.perf_counter()
            bus.sync_read(ids, FIRST, LAST)
            bus.sync_write('goal_pwm', dict.fromkeys(ids, 1))
            times.append(1e3 * (time.perf_counter() - began))
            time.sleep(0.005)
    return np.array(times)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('-n', type=int, default=300, help='periods')
    periods = parser.parse_args().n
    print(f'{"servos":>7}{"Mbaud":>7}{"computed ms":>13}{"emulated median":>17}{"p99":>7}')
    for count in (6, 9, 12):
        for baud in (1e6, 4e6):
            times = emulated(count, baud, periods)
            middle, most = np.percentile(times, (50, 99))
            print(
                f'{count:7}{baud / 1e6:7.0f}{computed(count, baud):13.2f}{middle:17.2f}'
                f'{most:7.2f}',
                flush=True,
            )


if __name__ == '__main__':
    main()
