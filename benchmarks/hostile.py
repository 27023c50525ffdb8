# SPDX-License-Identifier: Apache-2.0
"""Longest time between two states of a robot at 100 Hz while a stranger sends what is wrong.

    python benchmarks/hostile.py [--pause 2] [KIND ...]

For each kind: the longest gap in the quiet `pause` before it, and the longest while it lasts.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import os
from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
from threading import Thread
import time

import numpy as np
from rclpy.node import Node

from leo_learner.processes import free_domain
from leo_msgs_py import topics
from leo_msgs_py.node import graph

PEER = Path(__file__).parents[1] / 'tests/graph/hostile_peer.py'
LEO = Path(sys.executable).with_name('leo')
ROBOT = LEO, 'run', 'leo_sim', 'robot', '--ros-args', '-p', 'robot:=pendulum'
SETTLED = 3.0
MOST = 1e6


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('kinds', nargs='*')
    parser.add_argument('--pause', type=float, default=2.0, help='before each kind [s]')
    options = parser.parse_args()
    with free_domain() as domain, TemporaryDirectory() as folder:
        os.environ |= {'ROS_DOMAIN_ID': str(domain), 'XDG_RUNTIME_DIR': folder}
        with open(f'{folder}/log', 'w') as log, graph():
            robot = subprocess.Popen(ROBOT, stderr=log)
            try:
                measure(robot, options.kinds, options.pause)
            finally:
                robot.kill()


def measure(robot: subprocess.Popen, kinds: list[str], pause: float) -> None:
    """Attack a robot, and print how often it published."""
    states = Node('watch').create_subscription(
        *topics.JOINT_STATES[:2], lambda _: None, topics.LOSSLESS, raw=True
    )
    published: list[float] = []
    command = [sys.executable, PEER, 'robot', '--pause', str(pause), *kinds]
    time.sleep(SETTLED)
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as peer:
        said: list[tuple[float, str]] = []
        reader = Thread(target=lambda: said.extend((time.time(), line) for line in peer.stdout))
        reader.start()
        while reader.is_alive():
            published.extend(taken(states))
            time.sleep(0.02)
    print(f'longest time between two states [ms]{"before":>18}{"during":>8}{"sent":>8}')
    for name, count, began, ended in spans(said):
        gaps = [longest(published, *span) for span in ((began - pause, began), (began, ended))]
        print(f'{name:40}{gaps[0]:14.0f}{gaps[1]:8.0f}{count:>8}')
    print(f'the robot {"lives" if robot.poll() is None else "is dead"}')


def taken(states: object) -> Iterator[float]:
    """Times of publishing [s] of the messages that wait; long ones are a stranger's."""
    with states.handle:
        while (taken := states.handle.take_message(states.msg_type, True)) is not None:
            yield taken[1]['source_timestamp'] * 1e-9


def spans(said: list[tuple[float, str]]) -> Iterator[tuple[str, str, float, float]]:
    """Name, count, begin and end of each kind."""
    for (began, _), (ended, line) in zip(said[::2], said[1::2], strict=True):
        name, count = line.partition(' ')[2].split(': ')
        yield name, count.strip(), began, ended


def longest(published: list[float], began: float, ended: float) -> float:
    """Longest time [ms] between two states of which one was published in the span [s]."""
    times = np.sort(published)
    inside = np.flatnonzero((times >= began) & (times <= ended))
    if not inside.size:
        return (ended - began) * 1e3
    return float(np.diff(times[max(0, inside[0] - 1) : inside[-1] + 2]).max() * 1e3)


if __name__ == '__main__':
    main()
