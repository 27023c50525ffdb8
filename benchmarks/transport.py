# SPDX-License-Identifier: Apache-2.0
"""Round trip of a JointState between two processes, and messages per second.

    python benchmarks/transport.py [--samples 2000] [--json]

Prints our numbers beside those of a real rclpy and of bare cyclonedds (ros_wire.md: two
processes on loopback, 6 joints, 292 bytes of CDR, reliable, both cores 88 % busy).
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import time
from typing import Any

import numpy as np

from leo_msgs_py import messages as m
from leo_msgs_py.node import api
from leo_msgs_py.qos import reliable

JOINTS = 6
BURST = 5000
WAIT_S = 20.0
# median and 99th percentile [ms], from ros_wire.md, "Numbers", normal scheduling
REFERENCE = {
    'round trip at 30 Hz': 'rclpy 0.85-1.01 / 4.2-5.7, bare cyclonedds 0.66-1.07 / 1.1-5.6',
    'round trip back to back': 'rclpy 0.17-0.34 / 0.57-4.9, bare cyclonedds 0.18-0.29 / 0.25-0.62',
    'Trigger call': 'rclpy 0.26 / 3.7, bare cyclonedds 0.12 / 0.18',
}
REFERENCE_RATE = 'bare cyclonedds writes 24-26 thousand/s; its reader keeps about 3/4 of them'


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--samples', type=int, default=2000, help='round trips back to back')
    parser.add_argument('--json', action='store_true', help='print JSON')
    parser.add_argument('--echo', action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.echo:
        return echo()
    os.environ['ROS_DOMAIN_ID'] = str(random.randint(101, 200))
    with subprocess.Popen([sys.executable, __file__, '--echo']) as peer:
        try:
            result = measure(options.samples)
        finally:
            api.shutdown()
            peer.terminate()
    print(json.dumps(result) if options.json else table(result))
    return 0


def echo() -> int:
    """The other process: sends everything back, counts the burst, answers the service."""
    node = api.create_node('echo', ['--ros-args', '--log-level', 'error'])
    pong = node.create_publisher(m.JointState, 'pong', reliable(10))
    node.create_subscription(m.JointState, 'ping', pong.publish, reliable(10))
    kept: list[float] = []
    node.create_subscription(
        m.JointState, 'burst', lambda _: kept.append(time.monotonic()), reliable(BURST)
    )

    def count(_: Any, response: Any) -> Any:
        span = kept[-1] - kept[0] if kept else 1.0
        response.success, response.message = True, f'{len(kept)} {span}'
        return response

    node.create_service(m.Trigger, 'count', count)
    api.spin(node)
    api.shutdown()
    return 0


def measure(samples: int) -> dict[str, Any]:
    """Round trips [ms], call times [ms], messages per second."""
    node = api.create_node('bench', ['--ros-args', '--log-level', 'error'])
    message = m.JointState(name=[f'joint_{i:04d}' for i in range(JOINTS)])
    for field in ('position', 'velocity', 'effort'):
        setattr(message, field, [0.1] * JOINTS)
    slow = round_trips(node, message, max(50, samples // 20), 1 / 30)
    fast = round_trips(node, message, samples, 0.0)
    client = node.create_client(m.Trigger, 'count')
    calls = call_times(node, client, samples // 4)
    return {
        'milliseconds': {
            'round trip at 30 Hz': percentiles(slow),
            'round trip back to back': percentiles(fast),
            'Trigger call': percentiles(calls),
        },
        'messages_per_second': throughput(node, client, message),
    }


def round_trips(node: Any, message: Any, count: int, pause: float) -> list[float]:
    """Times [s] from publishing to the echo's callback."""
    back: list[float] = []
    ping = node.create_publisher(m.JointState, 'ping', reliable(10))
    pong = node.create_subscription(
        m.JointState, 'pong', lambda _: back.append(time.perf_counter()), reliable(10)
    )
    matched = lambda: ping.get_subscription_count() and pong.get_publisher_count()  # noqa: E731
    if not api.spin_until(node, matched, WAIT_S):
        raise SystemExit('the echo process did not appear')
    times = []
    for _ in range(count):
        back.clear()
        sent = time.perf_counter()
        ping.publish(message)
        while not back:
            api.spin_once(node, 1.0)
        times.append(back[0] - sent)
        time.sleep(pause)
    node.destroy_publisher(ping)
    node.destroy_subscription(pong)
    return times


def call_times(node: Any, client: Any, count: int) -> list[float]:
    """Times [s] of service calls."""
    client.wait_for_service(WAIT_S)
    times = []
    for _ in range(count):
        sent = time.perf_counter()
        future = client.call_async(m.Trigger.Request())
        while not future.done():
            api.spin_once(node, 1.0)
        times.append(time.perf_counter() - sent)
    return times


def throughput(node: Any, client: Any, message: Any) -> dict[str, float]:
    """A burst as fast as it goes: written and received per second, share received."""
    burst = node.create_publisher(m.JointState, 'burst', reliable(BURST))
    api.spin_until(node, lambda: burst.get_subscription_count() > 0, WAIT_S)
    start = time.perf_counter()
    for _ in range(BURST):
        burst.publish(message)
    written = time.perf_counter() - start
    burst.wait_for_all_acked(WAIT_S)
    before, kept, span = -1.0, 0.0, 1.0
    while kept != before:
        before = kept
        time.sleep(0.5)
        answer = api.call(node, client, m.Trigger.Request(), WAIT_S)
        kept, span = (float(word) for word in answer.message.split())
    return {
        'written': BURST / written,
        'received': kept / span,
        'share_received': kept / BURST,
    }


def percentiles(times: list[float]) -> dict[str, float]:
    """Median and 99th percentile [ms]."""
    median, p99 = np.percentile(times, [50, 99]) * 1e3
    return {'median': round(median, 3), 'p99': round(p99, 3), 'n': len(times)}


def table(result: dict[str, Any]) -> str:
    """The numbers beside the reference's."""
    lines = ['median / 99th percentile [ms]']
    for name, row in result['milliseconds'].items():
        ours = f'{row["median"]:.2f} / {row["p99"]:.2f} (n {row["n"]})'
        lines.append(f'  {name:24} {ours:26} reference: {REFERENCE[name]}')
    rate = result['messages_per_second']
    lines.append(
        f'messages per second: {rate["written"]:.0f} written, {rate["received"]:.0f} received '
        f'({rate["share_received"]:.0%}); reference: {REFERENCE_RATE}'
    )
    return '\n'.join(lines)


if __name__ == '__main__':
    raise SystemExit(main())
