# SPDX-License-Identifier: Apache-2.0
"""A million hostile commands to LEO on the emulated bus, beside a commander that means it.

    python benchmarks/hostile_servos.py [--count 1000000] [KIND ...]

An honest node commands 2 V at 50 Hz; a stranger sends each kind as fast as it goes. For each kind:
what was on the motors at most, the longest time between two states in the second before it and
while it lasted, the memory of the robot's process after it, and whether the robot stopped itself.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
import math
import subprocess
import sys
import time

from emulated import Emulated, emulated, PATIENCE
import numpy as np
from rclpy.node import Node
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String

from leo_msgs_py import topics
from leo_msgs_py.node import call, graph, join, spin_until
from leo_msgs_py.values import command_message

VOLTS, MANY = 2.0, 10**6
KIND, TOPIC, QOS = topics.COMMANDS['voltage']


def sized(*values: float) -> Float64MultiArray:
    """A command of six values, or of as many as are given."""
    return Float64MultiArray(data=list(values) * (6 if len(values) == 1 else 1))


KINDS: dict[str, Callable[[], object]] = {
    'NaN': lambda: sized(math.nan),
    'infinities': lambda: sized(math.inf),
    'negative infinities': lambda: sized(-math.inf),
    'one NaN of six': lambda: sized(1.0, 1.0, 1.0, math.nan, 1.0, 1.0),
    'wrong length': lambda: sized(*[1.0] * 7),
    'no values': Float64MultiArray,
    'malformed bytes': lambda: serialize_message(sized(1.0))[:9],
    'a million values': lambda: sized(*[1.0] * MANY),
    'another type': lambda: JointState(name=['left_hip'], effort=[5.0]),
    'text': lambda: String(data='[5.0, 5.0]'),
    '1e308': lambda: sized(1e308),
}
HEAVY = {'a million values': 1000}
"""Kinds of which one in so many is sent: 8 MB each."""


class Honest(Node):
    """Commands 2 V, and hears when states were published."""

    def __init__(self) -> None:
        super().__init__('honest')
        self._commands = self.create_publisher(KIND, TOPIC, QOS)
        self.create_timer(0.02, self._command)
        self.states = self.create_subscription(
            *topics.JOINT_STATES[:2], lambda _: None, topics.LOSSLESS, raw=True
        )
        self.unstop = self.create_client(*topics.E_STOP_RESET)
        self.stopped = False
        self.create_subscription(*topics.E_STOPPED[:2], self._on_stopped, topics.E_STOPPED.qos)

    def _on_stopped(self, message: object) -> None:
        self.stopped = self.stopped or message.data

    def _command(self) -> None:
        self._commands.publish(command_message([VOLTS] * 6))


def attack(kind: str, count: int) -> None:
    """Send one kind so many times."""
    with graph(['--ros-args', '--log-level', 'fatal']):
        node, message = Node('stranger'), KINDS[kind]()
        of = type(message) if not isinstance(message, bytes) else Float64MultiArray
        publisher = node.create_publisher(of, TOPIC, 10)
        time.sleep(1.0)
        data = message if isinstance(message, bytes) else serialize_message(message)
        for _ in range(count):
            publisher.publish(data)
        time.sleep(0.5)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('kinds', nargs='*')
    parser.add_argument('--count', type=int, default=10**6, help='messages over all kinds')
    parser.add_argument('--attack', help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.attack:
        attack(options.attack, options.count)
        return
    kinds = options.kinds or list(KINDS)
    print(
        f'{"":20}{"sent":>8}{"s":>6}{"largest |V|":>13}{"before":>9}{"during [ms]":>13}'
        f'{"MB":>8}  stopped itself'
    )
    with emulated(watchdog=2.0) as leo:
        node = join(Honest())
        leo.start_robot('fault_periods:=100')
        ready(leo, node)
        print(f'{"at first":59}{leo.memory("robot"):18.1f}')
        sent = [attacked(leo, node, kind, options.count // len(kinds)) for kind in kinds]
        print(
            f'{sum(sent)} messages; a traceback: '
            f'{"Traceback" in leo.said("robot")}; the robot lives: {leo.runs("robot")}'
        )


def ready(leo: Emulated, node: Honest) -> None:
    """The honest one's commands are on the motors."""
    assert spin_until(lambda: leo.driven(VOLTS), PATIENCE), leo.said('robot')
    node.stopped = False


def attacked(leo: Emulated, node: Honest, kind: str, count: int) -> int:
    """One kind, and a row of the table."""
    leo.start_robot('fault_periods:=100')
    call(node.unstop, topics.E_STOP_RESET.type.Request(), PATIENCE)
    ready(leo, node)
    list(taken(node.states))
    spin_until(lambda: False, 1.0)
    before = gap(list(taken(node.states)))
    count = max(1, count // HEAVY.get(kind, 1))
    began = time.monotonic()
    words = [sys.executable, __file__, '--attack', kind, '--count', str(count)]
    published: list[float] = []
    with subprocess.Popen(words) as peer:
        while peer.poll() is None:
            spin_until(lambda: peer.poll() is not None, 0.1)
            published.extend(taken(node.states))
    seconds = time.monotonic() - began
    print(
        f'{kind:20}{count:8}{seconds:6.1f}{leo.largest_since(began):13.3f}{before:9.1f}'
        f'{gap(published):13.1f}{leo.memory("robot"):8.1f}  {node.stopped}',
        flush=True,
    )
    if not leo.runs('robot'):
        print(leo.said('robot').splitlines()[-2])
    return count


def taken(states: object) -> Iterator[float]:
    """When the states that wait were published [s]."""
    with states.handle:
        while (found := states.handle.take_message(states.msg_type, True)) is not None:
            yield found[1]['source_timestamp'] * 1e-9


def gap(times: list[float]) -> float:
    """Longest time between two [ms]."""
    return 1e3 * float(np.diff(np.sort(times)).max()) if len(times) > 1 else math.nan


if __name__ == '__main__':
    main()
