# SPDX-License-Identifier: Apache-2.0
"""Robot, recorder and learner killed at random while they work, and ended by signals.

    python benchmarks/kills.py [--kills 20] [--ends 50] [--seed 0]

Kills each of the three `--kills` times with SIGKILL in random order, starts it again, and tells
whether the loop went on, how long that took, how much of the bag was lost, and how many files
lie in /dev/shm. Then starts a robot and a recorder `--ends` times and ends both with SIGINT or
SIGTERM.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import tempfile
import time

from rclpy.node import Node

from leo_msgs_py import topics
from leo_msgs_py.bag_contents import load
from leo_msgs_py.node import graph, join, spin_until
from leo_msgs_py.values import nanoseconds

LEO = Path(sys.executable).with_name('leo')
PATIENCE = 60.0


class Loop:
    """The three processes, in lockstep, and what is heard of them.

    Args:
        node: joined to the graph.
        folder: of bags, runs and logs.
    """

    def __init__(self, node: Node, folder: Path) -> None:
        self._folder, self._started = folder, 0
        self.stamps: list[int] = []
        kind, name, qos = topics.JOINT_STATES
        node.create_subscription(
            kind, name, lambda m: self.stamps.append(nanoseconds(m.header.stamp)), qos
        )
        self.processes = {name: self.start(name) for name in ('robot', 'recorder', 'learner')}

    def start(self, name: str) -> subprocess.Popen[bytes]:
        """Start one of the three."""
        self._started += 1
        bag, run = self._folder / 'bag', self._folder / f'run{self._started}'
        words = {
            'robot': 'run leo_sim robot --ros-args -p realtime_factor:=0 -p start:=random',
            'recorder': f'run leo_diffmodel diffmodel --ros-args -p bag:={bag}',
            'learner': f'learn --robot pendulum --on-robot --steps 10000000 -o {run}',
        }[name]
        with (self._folder / f'{name}.log').open('ab') as log:
            return subprocess.Popen([LEO, *words.split()], stdout=log, stderr=log)

    def bag(self) -> Path:
        """The bag that is being written."""
        return max(self._folder.glob('bag*/*.mcap'), key=lambda file: file.stat().st_ctime_ns)

    def goes_on(self) -> bool:
        """Whether states move and are recorded."""
        return self._grows(lambda: len(set(self.stamps[-400:]))) and self._grows(self._size)

    def _size(self) -> int:
        return sum(file.stat().st_size for file in self._folder.glob('bag*/*.mcap'))

    def _grows(self, measure: Callable[[], int]) -> bool:
        self.stamps.clear()
        before = measure()
        return spin_until(lambda: measure() > before + 100, PATIENCE)

    def stop(self) -> None:
        """Kill what runs."""
        for process in self.processes.values():
            process.kill()
            process.wait()


def killed(loop: Loop, name: str) -> tuple[bool, float, float]:
    """Kill and restart one; whether the loop goes on, after how long, and what was lost [s]."""
    bag = loop.bag()
    moment = time.time()
    loop.processes[name].kill()
    loop.processes[name].wait()
    lost = moment - newest(bag) if name == 'recorder' else 0.0
    began = time.monotonic()
    loop.processes[name] = loop.start(name)
    return loop.goes_on(), time.monotonic() - began, lost


def newest(bag: Path) -> float:
    """When the last message in a bag was recorded [s since epoch]."""
    return max(t.messages[-1].log_ns for t in load(bag).topics.values() if t.messages) * 1e-9


def shared_files() -> int:
    """How many files of Fast DDS there are."""
    return len(list(Path('/dev/shm').glob('fastrtps_*')))


def kills(node: Node, folder: Path, count: int) -> bool:
    """Kill each of the three so often; whether all went well."""
    loop, order = Loop(node, folder), ['robot', 'recorder', 'learner'] * count
    random.shuffle(order)
    rows = []
    try:
        print('the loop runs' if loop.goes_on() else 'the loop never ran', flush=True)
        for number, name in enumerate(order, 1):
            spin_until(lambda: False, random.uniform(0.2, 1.5))
            rows.append((name, *killed(loop, name)))
            print(
                f'{number}/{len(order)} {name}: goes on {rows[-1][1]}, {rows[-1][2]:.1f} s, '
                f'lost {rows[-1][3]:.3f} s, in /dev/shm {shared_files()}',
                flush=True,
            )
    finally:
        loop.stop()
    lost = [row[3] for row in rows if row[0] == 'recorder']
    print(
        f'went on {sum(row[1] for row in rows)} of {len(rows)}, most of a bag lost '
        f'{max(lost):.3f} s'
    )
    return all(row[1] for row in rows)


def ends(folder: Path, count: int) -> bool:
    """Start a robot and a recorder, end both with a signal; whether all ended well."""
    good = 0
    for number in range(count):
        how = (signal.SIGINT, signal.SIGTERM)[number % 2]
        bag = folder / f'end{number}'
        words = [
            ['leo_sim', 'robot'],
            ['leo_diffmodel', 'diffmodel', '--ros-args', '-p', f'bag:={bag}'],
        ]
        running = [subprocess.Popen([LEO, 'run', *w], stderr=subprocess.DEVNULL) for w in words]
        end = time.monotonic() + PATIENCE
        while not any(bag.glob('*.mcap')) and time.monotonic() < end:
            time.sleep(0.1)
        time.sleep(random.uniform(0.0, 1.0))
        for process in running:
            process.send_signal(how)
        statuses = [process.wait(PATIENCE) for process in running]
        finished = (bag / 'metadata.yaml').exists() and load(bag).finished
        good += statuses == [0, 0] and finished
        print(f'{number + 1}/{count} {how.name}: exit {statuses}, finished {finished}', flush=True)
    print(f'ended well {good} of {count}')
    return good == count


def main() -> int:
    """Kill, end, and tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--kills', type=int, default=20, help='of each process')
    parser.add_argument('--ends', type=int, default=50)
    parser.add_argument('--seed', type=int, default=0)
    options = parser.parse_args()
    random.seed(options.seed)
    os.environ['ROS_DOMAIN_ID'] = str(random.randint(101, 200))
    with tempfile.TemporaryDirectory() as name:
        os.environ['XDG_RUNTIME_DIR'] = name
        with graph(['--ros-args', '--log-level', 'error']):
            went_on = not options.kills or kills(join(Node('watcher')), Path(name), options.kills)
        ended = not options.ends or ends(Path(name), options.ends)
    return int(not (went_on and ended))


if __name__ == '__main__':
    raise SystemExit(main())
