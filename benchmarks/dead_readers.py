# SPDX-License-Identifier: Apache-2.0
"""How long a robot's loop stands still when a reader of its states is killed.

    python benchmarks/dead_readers.py [--kills 12] [--seed 0] [--profile FILE.xml]

A loop publishes states and inputs at 500 Hz with the robot's quality of service. A reader that
keeps all, as the recorder does, comes and is killed (SIGKILL) at a random moment. For each kill:
the largest gap of the loop from then until the reader is forgotten. `--stops` stops readers at
random moments instead, many more in the same time: one that is stopped with a lock keeps it as
one that is killed does. `--profile` is another profile file of Fast DDS than the one here.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import time

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState

from leo_diffmodel.nodes.graph_recorder import keeping_all
from leo_learner.demo.processes import free_domain
from leo_msgs_py import topics
from leo_msgs_py.node import graph, spare_collector
from leo_msgs_py.serialized import taken

PERIOD, WATCHED, PATIENCE = 0.002, 5.5, 20.0
TOPICS = topics.JOINT_STATES, topics.APPLIED['voltage']
NAMES = [f'joint_{k}' for k in range(7)]


def read() -> None:
    """Take all that comes, as the recorder does."""
    with graph(['--ros-args', '--log-level', 'error']):
        node = Node('reader')
        readers = [
            node.create_subscription(t.type, t.name, print, keeping_all(t.qos), raw=True)
            for t in TOPICS
        ]
        while True:
            time.sleep(0.02)
            for reader in readers:
                list(taken(reader))


class Loop:
    """A loop that publishes."""

    def __init__(self, node: Node) -> None:
        self._out = [node.create_publisher(t.type, t.name, topics.DEEP) for t in TOPICS]
        values = [0.1] * len(NAMES)
        self._message = JointState(name=NAMES, position=values, velocity=values, effort=values)

    def run(self, seconds: float) -> tuple[float, float]:
        """Publish so long; the largest gap, and the longest time in a publish() [s]."""
        end, last, gap, inside = time.monotonic() + seconds, time.monotonic(), 0.0, 0.0
        while last < end:
            for publisher in self._out:
                began = time.monotonic()
                publisher.publish(self._message)
                inside = max(inside, time.monotonic() - began)
            now = time.monotonic()
            gap, last = max(gap, now - last), now
            time.sleep(PERIOD)
        return gap, inside

    @property
    def readers(self) -> int:
        """How many read both."""
        return min(publisher.get_subscription_count() for publisher in self._out)


def kill(loop: Loop, count: int) -> tuple[float, float, float]:
    """Have readers come and be killed; the gap with them alive, and what follows the kill [s]."""
    words = [sys.executable, __file__, '--read']
    readers = [subprocess.Popen(words, stderr=subprocess.DEVNULL) for _ in range(count)]
    end = time.monotonic() + PATIENCE
    while loop.readers < count and time.monotonic() < end:
        loop.run(0.02)
    alive, _ = loop.run(random.uniform(0.3, 1.0))
    for reader in readers:
        reader.kill()
    gap, inside = loop.run(WATCHED)
    for reader in readers:
        reader.wait()
    while loop.readers and time.monotonic() < end:
        loop.run(0.02)
    return alive, gap, inside


def stops(loop: Loop, count: int, readers: int) -> int:
    """Stop readers for a moment, where each may have a lock, as one that is killed there."""
    words, waits = [sys.executable, __file__, '--read'], []
    processes = [subprocess.Popen(words, stderr=subprocess.DEVNULL) for _ in range(readers)]
    while loop.readers < readers:
        loop.run(0.02)
    loop.run(1.0)
    for _ in range(count):
        for process in processes:
            process.send_signal(signal.SIGSTOP)
        waits.append(loop.run(0.03)[1])
        for process in processes:
            process.send_signal(signal.SIGCONT)
        loop.run(random.uniform(0.02, 0.06))
    for process in processes:
        process.kill()
        process.wait()
    found = 1e3 * np.array(waits)
    waited = f'median {np.median(found):.1f} ms, worst {found.max():.0f}'
    above = int((found > 300).sum())
    print(f'{count} stops of {readers} readers: in publish() {waited}; above 300 ms: {above}')
    return int((found > 300).any())


def main() -> int:
    """Kill and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--kills', type=int, default=12)
    parser.add_argument('--readers', type=int, default=1, help='killed at once')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--profile', type=Path)
    parser.add_argument('--stops', type=int, default=0, help='stop readers for 30 ms instead')
    parser.add_argument('--read', action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.read:
        read()
        return 0
    random.seed(options.seed)
    if options.profile:
        os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'] = str(options.profile.resolve())
    with free_domain() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        with graph(['--ros-args', '--log-level', 'error']):
            loop = Loop(Node('robot'))
            spare_collector()
            if options.stops:
                return stops(loop, options.stops, options.readers)
            rows = []
            for number in range(options.kills):
                rows.append(kill(loop, options.readers))
                before, after, inside = (1e3 * seconds for seconds in rows[-1])
                said = f'{before:.1f} ms before, {after:.1f} after the kill'
                print(
                    f'{number + 1}/{options.kills}: gap {said}, {inside:.1f} in publish()',
                    flush=True,
                )
    alive, gaps, inside = 1e3 * np.array(rows).T
    print(
        f'largest gap: median {np.median(gaps):.1f} ms, worst {gaps.max():.1f} '
        f'(before a kill {np.median(alive):.1f}, {alive.max():.1f}); in publish() at most '
        f'{inside.max():.1f}; above 100 ms: {int((gaps > 100).sum())} of {len(gaps)}'
    )
    return int(gaps.max() > 100)


if __name__ == '__main__':
    raise SystemExit(main())
