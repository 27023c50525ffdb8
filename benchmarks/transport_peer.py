# SPDX-License-Identifier: Apache-2.0
"""The processes that benchmarks/transport.py starts, with the Python of either checkout.

    PYTHON transport_peer.py echo|trips|drive|first COUNT

Runs on the node layer of today and on that of commit 41d7e69 (its own ROS wire protocol).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
import json
import sys
import time
from typing import Any

import numpy as np

JOINTS = 6
WAIT_S = 30.0
QUIET = ['--ros-args', '--log-level', 'error']
Spin = Callable[[float], object]


@contextmanager
def node_of(name: str) -> Iterator[tuple[Any, Spin]]:
    """A node and what serves it for a while."""
    if find_spec('cyclonedds'):
        from leo_msgs_py.node import api

        node = api.create_node(name, QUIET)
        yield node, lambda seconds: api.spin_once(node, seconds) if api.ok() else sys.exit()
        api.shutdown()
        return
    from rclpy.node import Node

    from leo_msgs_py.node import graph, join, running, spin_once

    with graph(QUIET):
        yield join(Node(name)), lambda seconds: spin_once(seconds) if running() else sys.exit()


def joint_state() -> Any:
    """A message class, and one with six joints."""
    from leo_msgs_py import topics

    values = [0.1] * JOINTS
    kind = topics.JOINT_STATES.type
    names = [f'joint_{i:04d}' for i in range(JOINTS)]
    return kind, kind(name=names, position=values, velocity=values, effort=values)


def echo(_: int) -> dict[str, float]:
    """Send everything back until told to stop; never returns figures."""
    kind, _message = joint_state()
    with node_of('echo') as (node, spin):
        pong = node.create_publisher(kind, 'pong', 10)
        node.create_subscription(kind, 'ping', pong.publish, 10)
        while True:
            spin(0.5)


def trips(count: int) -> dict[str, float]:
    """Median round trips [ms] and CPU per message [us], back to back and at 30 Hz."""
    kind, message = joint_state()
    back: list[float] = []
    with node_of('trips') as (node, spin):
        ping = node.create_publisher(kind, 'ping', 10)
        node.create_subscription(kind, 'pong', lambda _: back.append(time.perf_counter()), 10)
        until(lambda: ping.get_subscription_count() and node.count_publishers('/pong'), spin)

        def trip(pause: float) -> float:
            back.clear()
            sent = time.perf_counter()
            ping.publish(message)
            until(lambda: back, spin)
            time.sleep(pause)
            return back[0] - sent

        began = time.process_time()
        fast = [trip(0.0) for _ in range(count)]
        cpu = (time.process_time() - began) / (2 * count)
        slow = [trip(1 / 30) for _ in range(count // 20)]
    return {
        'round trip back to back [ms]': 1e3 * float(np.median(fast)),
        'its 99th percentile [ms]': 1e3 * float(np.percentile(fast, 99)),
        'round trip at 30 Hz [ms]': 1e3 * float(np.median(slow)),
        'CPU per message [us]': 1e6 * cpu,
    }


def drive(count: int) -> dict[str, float]:
    """Control periods in lockstep with the robot that runs: states per second."""
    from leo_learner.robot_env import RobotEnv
    from leo_sim.description.robot import load_robot

    robot, rng = load_robot('pendulum'), np.random.default_rng(0)
    with node_of('drive') as (node, _):
        env = RobotEnv(node, robot)
        env.reset()
        for _ in range(20):
            env.step(rng.uniform(-1, 1, 1))
        began, cpu = time.monotonic(), time.process_time()
        for _ in range(count):
            env.step(rng.uniform(-1, 1, 1))
        took, used = time.monotonic() - began, time.process_time() - cpu
    states = count * robot.control_period * robot.state_rate
    return {
        'lockstep [states/s]': states / took,
        'learner CPU per state [us]': 1e6 * used / states,
    }


def first(_: int) -> dict[str, float]:
    """Wait for the first state of a robot that is being started; when it came [s since epoch]."""
    kind, _message = joint_state()
    heard: list[float] = []
    with node_of('first') as (node, spin):
        node.create_subscription(kind, 'joint_states', lambda _: heard.append(time.time()), 10)
        print('listening', flush=True)
        until(lambda: heard, spin)
    return {'at': heard[0]}


def until(condition: Callable[[], object], spin: Spin) -> None:
    """Spin until something holds; SystemExit where it does not in time."""
    end = time.monotonic() + WAIT_S
    while not condition():
        if time.monotonic() > end:
            raise SystemExit('the other side does not answer')
        spin(0.1)


if __name__ == '__main__':
    role = {'echo': echo, 'trips': trips, 'drive': drive, 'first': first}[sys.argv[1]]
    print(json.dumps(role(int(sys.argv[2]))), flush=True)
