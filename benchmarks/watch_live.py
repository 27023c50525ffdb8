# SPDX-License-Identifier: Apache-2.0
"""What `leo watch --live` costs a pendulum at 100 Hz: jitter with and without the page, memory.

    python benchmarks/watch_live.py [--minutes 60] [--alone 2]

The robot runs alone, with the page and one tab that is kept up to date, and alone again. Its
jitter is read from the times at which it published its states; memory is that of the page's
process.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Any

from bokeh.client import pull_session
import numpy as np
from rclpy.node import Node

from leo_learner.demo.processes import free_domain
from leo_msgs_py import topics
from leo_msgs_py.node import graph, join, listen_with_info, running, spin_once
from leo_msgs_py.terminal import leo_process
from leo_msgs_py.values import command_message

PERIOD, HOLD, VOLTS, SAMPLE = 0.01, 0.3, 1.5, 30.0
NOISE = 'noise:=[0.001, 0.03]'


class Beside(Node):
    """Commands steps of random size and notes when each state was published [ns]."""

    def __init__(self) -> None:
        super().__init__('beside')
        kind, name, qos = topics.COMMANDS['voltage']
        self._commands, self._random = self.create_publisher(kind, name, qos), 0.0
        self.times: list[int] = []
        listen_with_info(self, topics.JOINT_STATES._replace(qos=topics.DEEP), self._heard)
        self.create_timer(0.05, self._command)

    def _heard(self, _: Any, info: dict[str, Any]) -> None:
        self.times.append(info['source_timestamp'])

    def _command(self) -> None:
        seed = int(time.monotonic() / HOLD)
        volts = np.random.default_rng(seed).uniform(-VOLTS, VOLTS)
        self._commands.publish(command_message([volts]))


def main() -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--minutes', type=float, default=60.0, help='with the page')
    parser.add_argument(
        '--alone', type=float, default=2.0, help='minutes without, half of them before'
    )
    options = parser.parse_args()
    with free_domain() as domain, graph_in(domain):
        node = join(Beside())
        robot = leo('run', 'leo_sim', 'robot', '--ros-args', '-p', 'robot:=pendulum', '-p', NOISE)
        spend(node, 5.0)
        before = spend(node, 30.0 * options.alone)
        page = leo('watch', '--live', '--model', 'pendulum', '--no-browser', '--json')
        try:
            with_page = jitter(watched(node, page, 60.0 * options.minutes))
            end(page)
            alone = jitter(before, spend(node, 30.0 * options.alone))
        finally:
            end(page)
            end(robot)
    for name, a, b in zip(('std', '99 %', '99.9 %', 'max'), alone, with_page, strict=True):
        print(f'jitter {name}: {a:.3f} ms alone, {b:.3f} ms with the page, ratio {b / a:.2f}')
    return 0


def graph_in(domain: int) -> Any:
    """The graph in a domain of its own, the children's too."""
    import os

    os.environ['ROS_DOMAIN_ID'] = str(domain)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    return graph(['--ros-args', '--log-level', 'warn'])


def leo(*words: str) -> subprocess.Popen:
    """Start a command."""
    command, ignored = leo_process(*words), subprocess.DEVNULL
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=ignored, text=True)


def end(process: subprocess.Popen) -> None:
    """Interrupt a command that still runs, and wait for it."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        process.wait(20)


def spend(node: Beside, seconds: float) -> np.ndarray:
    """Times at which states were published meanwhile [s]."""
    first, end = len(node.times), time.monotonic() + seconds
    while running() and time.monotonic() < end:
        spin_once(0.05)
    return np.array(node.times[first:]) * 1e-9


def watched(node: Beside, page: subprocess.Popen, seconds: float) -> np.ndarray:
    """The same with a tab that is brought up to date; tells the page's memory now and then."""
    spend(node, 12.0)
    session = pull_session(url=json.loads(page.stdout.readline())['url'])
    found, began = [], time.monotonic()
    while running() and (passed := time.monotonic() - began) < seconds:
        print(f'{passed / 60.0:6.1f} min  {memory(page.pid):6.1f} MB', flush=True)
        for _ in range(round(SAMPLE)):
            found.append(spend(node, 1.0))
            session.force_roundtrip()
    print(f'{passed / 60.0:6.1f} min  {memory(page.pid):6.1f} MB', flush=True)
    return np.concatenate(found)


def memory(pid: int) -> float:
    """Resident memory of a process [MB]."""
    text = Path(f'/proc/{pid}/status').read_text()
    return float(text.split('VmRSS:')[1].split()[0]) / 1024.0


def jitter(*stretches: np.ndarray) -> np.ndarray:
    """Std, 99 and 99.9 % quantiles and largest of how far steps are from the period [ms]."""
    steps = np.concatenate([np.diff(times) for times in stretches])
    off = 1e3 * (steps - PERIOD)
    size = np.abs(off)
    return np.array([off.std(), *np.quantile(size, [0.99, 0.999]), size.max()])


if __name__ == '__main__':
    sys.exit(main())
