# SPDX-License-Identifier: Apache-2.0
"""How long the e-stop of the live page takes to a robot, while the page's server is busy.

    python benchmarks/e_stop.py [--tries 30]
    python benchmarks/e_stop.py --garbage [--tries 30]

A browser (here a process that posts what the button posts) asks at random moments. A robot of
another process notes when the request reached it. The page's one loop is idle, busy in Python, or
held by C code that gives nobody a turn for 50 ms; at last it asks through the loop, as the button
alone did before.

With --garbage it is the service that is called, 200 malformed commands a second come beside good
ones, and the motors of LEO (Dynamixel) and SO-101 (Feetech) on the emulated bus are looked at: a
row says when they were at 0 V or free, and what stood at them at most (`servo_faults.py`). Where a
real-time class is allowed all of them run in one, whoever asks for the e-stop too: on a busy
machine an ordinary process is not let to ask for tens of ms.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
from threading import Thread
import time
from urllib.request import Request, urlopen

from bokeh.server.server import Server
import numpy as np
from rclpy.node import Node

from leo_diffmodel.nodes.live_robot import live_robot
from leo_diffmodel.watch.page.e_stop import own_way
from leo_learner.demo.processes import free_domain
from leo_msgs_py import topics
from leo_msgs_py.node import graph, spin

ORIGIN = 'http://localhost:5006'
BUSY = 10.0
GARBAGE_RATE = 200.0
"""Malformed commands per second."""
GARBAGE = 'NaN', 'infinities', 'one NaN of six', 'wrong length', 'malformed bytes', '1e308'


def robot() -> None:
    """Answer the e-stop, and print when it came [s, monotonic]."""
    with graph(['--ros-args', '--log-level', 'error']):
        node = Node('robot')

        def stop(_: object, response: object) -> object:
            print(time.monotonic(), flush=True)
            response.success = True
            return response

        node.create_service(*topics.E_STOP, stop)
        print('ready', flush=True)
        spin(node)


def browser(url: str, tries: int) -> None:
    """Post at random moments; print when [s, monotonic], and when the answer was there."""
    for _ in range(tries):
        time.sleep(random.uniform(0.05, 0.25))
        began = time.monotonic()
        with urlopen(Request(url, b'', {'Origin': ORIGIN}), timeout=30) as answer:
            print(json.dumps([began, time.monotonic(), answer.read().decode()]), flush=True)


def python_busy(until: float) -> None:
    """Python code that never waits."""
    while time.monotonic() < until:
        sum(range(1000))


def c_busy(until: float) -> None:
    """C code that holds the interpreter for some 50 ms at a time."""
    numbers = list(range(2_500_000))
    while time.monotonic() < until:
        sum(numbers)


LOADS = {'idle': lambda _: None, 'busy in Python': python_busy, 'busy in C': c_busy}


def measured(name: str, peer: subprocess.Popen, url: str, tries: int, loop: object) -> None:
    """One row."""
    words = [sys.executable, __file__, '--browser', url, '--tries', str(tries)]
    client = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    while client.poll() is None:
        loop.add_callback(LOADS[name], time.monotonic() + BUSY if name != 'idle' else 0.0)
        if name == 'idle':
            client.wait()
        else:
            time.sleep(BUSY)
    asked = [json.loads(line) for line in client.stdout.read().splitlines()]
    came = [float(peer.stdout.readline()) for _ in asked]
    there = 1e3 * np.array([c - a[0] for c, a in zip(came, asked, strict=True)])
    back = 1e3 * np.array([a[1] - a[0] for a in asked])
    untold = sum(a[2] != '' for a in asked)
    print(
        f'{name:16}{len(asked):4} tries: at the robot after {np.median(there):6.1f} ms, worst '
        f'{there.max():6.1f}; answer after {np.median(back):6.1f} ms, worst {back.max():6.1f}; '
        f'{untold} unanswered',
        flush=True,
    )


def through_the_loop(peer: subprocess.Popen, robot: object, loop: object) -> None:
    """As before: the button's callback waits for its turn."""
    loop.add_callback(python_busy, time.monotonic() + BUSY)
    time.sleep(0.2)
    began = time.monotonic()
    loop.add_callback(robot.e_stop)
    took = float(peer.stdout.readline()) - began
    print(f'through the loop, 1 try: at the robot after {took:.1f} s')


def stranger(interface: str) -> None:
    """Send malformed commands until killed."""
    from hostile_servos import KINDS

    with graph(['--ros-args', '--log-level', 'fatal']):
        kind, name, _ = topics.COMMANDS[interface]
        publisher = Node('stranger').create_publisher(kind, name, 10)
        for sent in GARBAGE * 10**6:
            publisher.publish(KINDS[sent]())
            time.sleep(1.0 / GARBAGE_RATE)


def beside_garbage(tries: int) -> None:
    """A row for each bus."""
    import servo_faults

    servo_faults.real_time(os.getpid())
    for robot, start, made in (
        ('leo', 'hanging', servo_faults.Bench),
        ('so101', 'nominal', servo_faults.GoalBench),
    ):
        with servo_faults.emulated(start, robot=robot) as bus:
            bench = servo_faults.join(made(bus))
            bench.ready()
            peer = subprocess.Popen([sys.executable, __file__, '--stranger', made.interface])
            assert servo_faults.spin_until(lambda b=bus: 'ignored' in b.said('robot'), 60.0)
            print(f'{robot} ({bus.family}): median, p90, p99, max; {bench.heading}')
            cases = [servo_faults.measured(bench, 'e-stop') for _ in range(tries)]
            servo_faults.print_row(bench, 'e-stop', cases)
            peer.kill()
            said = bus.said('robot').count('command ignored')
            print(f'{said} lines of the robot, one a second, say that commands were ignored')


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--tries', type=int, default=30)
    parser.add_argument('--browser', help=argparse.SUPPRESS)
    parser.add_argument('--garbage', action='store_true', help='on emulated servos')
    parser.add_argument('--stranger', help=argparse.SUPPRESS)
    parser.add_argument('--robot', action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.robot:
        robot()
    elif options.stranger:
        stranger(options.stranger)
    elif options.garbage:
        beside_garbage(options.tries)
    elif options.browser:
        browser(options.browser, options.tries)
    else:
        compare(options.tries)


def compare(tries: int) -> None:
    """All loads on one page."""
    with free_domain() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        words = [sys.executable, __file__, '--robot']
        peer = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        peer.stdout.readline()
        server = Server({}, port=0)
        loop = server.io_loop
        with live_robot(10.0, []) as live, own_way(live.stopped, ORIGIN) as url:
            live._stop.wait_for_service(10.0)

            def steps() -> None:
                for name in LOADS:
                    measured(name, peer, url, tries, loop)
                through_the_loop(peer, live, loop)
                loop.add_callback(loop.stop)

            Thread(target=steps).start()
            loop.start()
        peer.kill()


if __name__ == '__main__':
    main()
