# SPDX-License-Identifier: Apache-2.0
"""How long the motors behind the emulated bus are driven after something goes wrong.

    python benchmarks/servo_faults.py [-n 20] [KIND ...]

LEO hangs and is commanded 2 V at 50 Hz; at a random moment the fault comes. The time is from the
fault to the first moment at which every motor is at 0 V or free, in the bus's own record of what
is on the motors, on one clock. Commands go on unless the fault is that they end.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import suppress
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
from tempfile import TemporaryDirectory
import time

import numpy as np
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter

from leo_learner.experiments.processes import free_domain
from leo_msgs_py import topics
from leo_msgs_py.node import call, graph, join, spin_once, spin_until
from leo_msgs_py.values import Command

LEO = str(Path(sys.executable).with_name('leo'))
PATIENCE = 60.0
VOLTS, LIMIT = 2.0, 8.6
BUS_LOSS = (0.01, 0.1, 0.5)


class Bench(Node):
    """A commander that counts, with the bus and the robot as processes."""

    def __init__(self, folder: Path) -> None:
        super().__init__('bench')
        self.folder, self.link, self.log = folder, folder / 'port', folder / 'motors'
        kind, name, qos = topics.COMMANDS['voltage']
        self._commands = self.create_publisher(kind, name, qos)
        self._set = self.create_client(SetParameters, '/servo_bus/set_parameters')
        self.stop = self.create_client(*topics.E_STOP)
        self.unstop = self.create_client(*topics.E_STOP_RESET)
        self.talks = True
        self.sent = 0.0
        self.create_timer(0.02, self._command)
        self.bus = self._start('servo_bus', f'link:={self.link}', f'log:={self.log}')
        self.robot: subprocess.Popen | None = None

    def ready(self) -> None:
        """A robot that runs, all cables in, every motor driven."""
        self.set(bus_cable=True, usb_cable=True, silent=-1, lose=0.0)
        assert spin_until(self.link.is_symlink, PATIENCE)
        self.talks = True
        spin_until(lambda: False, 0.2)  # one that ends now has ended
        deadline = time.monotonic() + PATIENCE
        while not (self._released() and spin_until(self._driven, 3.0)):
            assert time.monotonic() < deadline, self.said()[-2000:]

    def set(self, **values: object) -> None:
        """Set parameters of the bus."""
        asked = [Parameter(n, value=v).to_parameter_msg() for n, v in values.items()]
        call(self._set, SetParameters.Request(parameters=asked), PATIENCE)

    def moments(self) -> list[tuple[float, np.ndarray]]:
        """Times [s] and voltages of all motors, NaN where free, at each change."""
        if not self.log.exists():
            return []
        rows = self.log.read_text().rpartition('\n')[0].splitlines()
        return [(float(r.split()[0]), np.array(r.split()[1:], float)) for r in rows]

    def stopped_after(self, began: float) -> float:
        """Time [s] from `began` until all motors were at 0 or free, and stayed so."""
        deadline = time.monotonic() + 5.0
        while time.monotonic() < deadline:
            spin_once(0.02)
            rows = self.moments()
            if rows and not np.nan_to_num(rows[-1][1]).any() and rows[-1][0] > began - 0.02:
                break
        driven = [k for k, (_, volts) in enumerate(rows) if np.nan_to_num(volts).any()]
        last = driven[-1]
        return max(0.0, rows[last + 1][0] - began) if last + 1 < len(rows) else np.inf

    def said(self) -> str:
        """What the robot and the bus said."""
        return ''.join(p.read_text() for p in sorted(self.folder.glob('*.out')))

    def _released(self) -> bool:
        if self.robot is None or self.robot.poll() is not None:
            self.robot = self._start('robot', 'driver:=dynamixel', f'port:={self.link}')
        try:
            call(self.unstop, topics.E_STOP_RESET.type.Request(), 1.0)
        except TimeoutError:  # the one that answered before was killed
            return False
        return True

    def _driven(self) -> bool:
        rows = self.moments()
        return bool(rows) and bool((np.abs(np.nan_to_num(rows[-1][1])) > 0.9 * VOLTS).all())

    def _command(self) -> None:
        if self.talks:
            self._commands.publish(Command([VOLTS] * 6).to_message())
            self.sent = time.monotonic()

    def _start(self, executable: str, *parameters: str) -> subprocess.Popen:
        words = [x for p in ('robot:=leo', 'start:=hanging', *parameters) for x in ('-p', p)]
        out = (self.folder / f'{executable}.out').open('a')
        process = subprocess.Popen(
            [LEO, 'run', 'leo_sim', executable, '--ros-args', *words], stdout=out, stderr=out)
        with suppress(PermissionError):  # other work on this machine is not what is measured
            os.setpriority(os.PRIO_PROCESS, process.pid, -15)
        return process


def e_stop(bench: Bench) -> float:
    """The service is called; a node that has ended by itself has stopped before."""
    began = time.monotonic()
    try:
        call(bench.stop, topics.E_STOP.type.Request(), 2.0)
    except TimeoutError:
        assert bench.robot.poll() == 1, bench.said()[-2000:]
    return began


def no_command(bench: Bench) -> float:
    """Commands end; the time-out of 0.2 s is taken off."""
    bench.talks = False
    return bench.sent + 0.2


def killed(bench: Bench) -> float:
    """Kill -9."""
    bench.robot.send_signal(signal.SIGKILL)
    return time.monotonic()


def breaking(**values: object) -> Callable[[Bench], float]:
    """A parameter of the bus is set."""

    def act(bench: Bench) -> float:
        began = time.monotonic()
        bench.set(**values)
        return began

    return act


def losing(share: float) -> Callable[[Bench], float]:
    """An e-stop while packets are lost."""

    def act(bench: Bench) -> float:
        bench.set(lose=share)
        spin_until(lambda: False, random.uniform(0.05, 0.1))
        return e_stop(bench)

    return act


KINDS: dict[str, Callable[[Bench], float]] = {
    'e-stop': e_stop,
    'no command': no_command,
    'kill -9': killed,
    'bus cable out': breaking(bus_cable=False),
    'usb cable out': breaking(usb_cable=False),
    'servo 3 silent': breaking(silent=3),
    **{f'e-stop, {share:.0%} lost': losing(share) for share in BUS_LOSS},
}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('kinds', nargs='*', help=', '.join(KINDS))
    parser.add_argument('-n', type=int, default=20)
    options = parser.parse_args()
    with free_domain() as domain, TemporaryDirectory() as folder:
        os.environ |= {'ROS_DOMAIN_ID': str(domain), 'XDG_RUNTIME_DIR': folder}
        with graph(['--ros-args', '--log-level', 'error']):
            bench = join(Bench(Path(folder)))
            try:
                report(bench, options.kinds or list(KINDS), options.n)
            finally:
                for process in (bench.robot, bench.bus):
                    if process is not None:
                        process.kill()


def report(bench: Bench, kinds: list[str], count: int) -> None:
    """Each kind so many times."""
    print(f'{"":20}{"n":>5}{"median":>9}{"p90":>8}{"max [ms]":>10}{"largest |V|":>13}', flush=True)
    for kind in kinds:
        times = []
        for _ in range(count):
            bench.ready()
            spin_until(lambda: False, random.uniform(0.05, 0.3))
            times.append(1e3 * bench.stopped_after(KINDS[kind](bench)))
        largest = max(float(np.nanmax(np.abs(v))) for _, v in bench.moments() if (v == v).any())
        middle, most = np.percentile(times, (50, 90))
        print(f'{kind:20}{count:>5}{middle:9.1f}{most:8.1f}{max(times):10.1f}{largest:13.3f}',
              flush=True)
    print(f'tracebacks: {bench.said().count("Traceback")}')


if __name__ == '__main__':
    main()
