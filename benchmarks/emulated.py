# SPDX-License-Identifier: Apache-2.0
"""The emulated bus and the robot on it as processes, and what the bus says of its motors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
import math
import os
from pathlib import Path
import shutil
import subprocess
import sys
from tempfile import TemporaryDirectory

import numpy as np
import yaml

from leo_learner.demo.processes import free_domain
from leo_msgs_py.node import graph, spin_until
from leo_sim.description.robot import load_robot

LEO = str(Path(sys.executable).with_name('leo'))
PATIENCE = 300.0  # the first start in a fresh clone compiles kernels [s]
MEMORY = Path('/dev/shm')
DRIVER, HARDWARE = 2, 3
"""Priorities in real time: servos wait for no computer, a driver for no player."""


class Emulated:
    """A robot, LEO unless another is named, on an emulated bus.

    Bus and robot run in a real-time class where that is allowed, as on a robot's computer; the bus
    from when it is up, since whoever compiles in that class is throttled by the kernel. The folder
    is in memory where that is possible: neither other work nor the disk is what is measured.

    Args:
        folder: for the port, the logs and the bags.
        start: start pose of both.
        bus: further parameters of the bus, as NAME:=VALUE.
        watchdog: how long LEO's servos wait for a packet [s]; robot.yaml's where 0.
        robot: which it is.

    Attributes:
        family: of its servos.
        driver: what the robot is started with.
    """

    def __init__(
        self,
        folder: Path,
        start: str = 'hanging',
        bus: Sequence[str] = (),
        watchdog: float = 0.0,
        robot: str = 'leo',
    ) -> None:
        self.folder, self._start = folder, start
        self.robot = patient(folder, watchdog) if watchdog else robot
        self.family = self.driver = load_robot(robot).driver.family
        self.port, self.log = folder / 'port', folder / 'motors'
        self.processes: dict[str, subprocess.Popen] = {}
        self._moments: list[tuple[float, np.ndarray]] = []
        self._late: list[tuple[float, float]] = []
        self._read = 0
        self._node('servo_bus', f'link:={self.port}', f'log:={self.log}', *bus)
        assert spin_until(self.port.is_symlink, PATIENCE), self.said()
        real_time(self.processes['servo_bus'].pid, HARDWARE)

    def start_robot(self, *more: str) -> None:
        """Start the robot node, unless one runs."""
        if not self.runs('robot'):
            self._node('robot', f'driver:={self.driver}', f'port:={self.port}', *more)
            real_time(self.processes['robot'].pid, DRIVER)

    def start(self, name: str, *words: str) -> subprocess.Popen:
        """Start `leo WORDS`; what it says goes to NAME.out."""
        with (self.folder / f'{name}.out').open('a') as out:
            process = subprocess.Popen([LEO, *words], stdout=out, stderr=out, cwd=self.folder)
        self.processes[name] = process
        return process

    def runs(self, name: str) -> bool:
        """Whether a process was started and has not ended."""
        return name in self.processes and self.processes[name].poll() is None

    def stop(self, name: str) -> int:
        """End a process; its exit status."""
        self.processes[name].terminate()
        return self.processes[name].wait(PATIENCE)

    def said(self, name: str = '*') -> str:
        """What one process said, or all."""
        return ''.join(p.read_text() for p in sorted(self.folder.glob(f'{name}.out')))

    def memory(self, name: str) -> float:
        """Resident memory of a process [MB]; NaN where it has ended."""
        if not self.runs(name):
            return math.nan
        status = Path(f'/proc/{self.processes[name].pid}/status').read_text()
        return int(status.split('VmRSS:')[1].split()[0]) / 1e3

    def kept_waiting(self, name: str) -> dict[str, float]:
        """How long each thread of a process was ready to run but not let to, so far [s]."""
        waits = {}
        for task in Path(f'/proc/{self.processes[name].pid}/task').glob('*/schedstat'):
            with suppress(OSError, IndexError):
                waits[task.parent.name] = int(task.read_text().split()[1]) * 1e-9
        return waits

    def moments(self) -> list[tuple[float, np.ndarray]]:
        """Times [s] and voltages (goals) of all motors, NaN where free, at each change."""
        if not self.log.exists():
            return []
        with self.log.open() as file:
            file.seek(self._read)
            whole = file.read().rpartition('\n')[0]
        self._read += len(whole) + bool(whole)
        for row in (line.split() for line in whole.splitlines()):
            if row[1] == 'late':
                self._late.append((float(row[0]), float(row[2])))
            else:
                self._moments.append((float(row[0]), np.array(row[1:], float)))
        return self._moments

    def driven(self, volts: float) -> bool:
        """Whether each motor has about so many volts or more now."""
        rows = self.moments()
        return bool(rows) and bool((np.abs(np.nan_to_num(rows[-1][1])) > 0.9 * volts).all())

    def waited(self, began: float) -> float:
        """How long the bus was kept waiting since a time [s]."""
        return sum(late for at, late in self._late if at >= began)

    def largest_since(self, began: float) -> float:
        """The largest voltage on a motor since a time [s]."""
        found = [np.abs(volts) for at, volts in self.moments() if at >= began]
        return float(np.nanmax(np.nan_to_num(found), initial=0.0))

    def _node(self, executable: str, *parameters: str) -> None:
        words = [f'robot:={self.robot}', f'start:={self._start}', *parameters]
        pairs = (word.split(':=', 1) for word in words)
        given = {name: yaml.safe_load(value) for name, value in pairs}
        file = self.folder / f'{executable}.yaml'  # in a folder that nobody else can read
        file.write_text(yaml.safe_dump({'/**': {'ros__parameters': given}}))
        self.start(
            executable, 'run', 'leo_sim', executable, '--ros-args', '--params-file', str(file)
        )


def real_time(process: int, priority: int = 1) -> None:
    """Have a process, its threads and those to come run before all of lower priority."""
    for task in Path(f'/proc/{process}/task').iterdir():
        with suppress(PermissionError, ProcessLookupError):
            os.sched_setscheduler(int(task.name), os.SCHED_RR, os.sched_param(priority))


def patient(folder: Path, watchdog: float) -> str:
    """LEO with servos that wait so long for a packet [s]; the folder it is in."""
    made = folder / 'patient'
    shutil.copytree(load_robot('leo').folder, made)
    file = made / 'robot.yaml'
    text = file.read_text()
    assert text.count('    baud:') == 1
    file.unlink()
    wait = f'    watchdog: {{value: {watchdog}, unit: s}}\n'
    file.write_text(text.replace('    baud:', f'{wait}    baud:'))
    return str(made)


@contextmanager
def emulated(
    start: str = 'hanging', bus: Sequence[str] = (), watchdog: float = 0.0, robot: str = 'leo'
) -> Iterator[Emulated]:
    """A robot on an emulated bus, in a domain and a folder of its own; nothing is left behind."""
    with (
        free_domain() as domain,
        TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder,
    ):
        runtime = f'{folder}/runtime'  # in which a folder `leo` is made, that is no robot
        os.environ |= {'ROS_DOMAIN_ID': str(domain), 'XDG_RUNTIME_DIR': runtime}
        with graph(['--ros-args', '--log-level', 'error']):
            made = Emulated(Path(folder), start, bus, watchdog, robot)
            try:
                yield made
            finally:
                for process in made.processes.values():
                    process.kill()
                    process.wait()
