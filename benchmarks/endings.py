# SPDX-License-Identifier: Apache-2.0
"""Recordings ended at random moments: what was sent, what the bag holds, what was said to be lost.

    python benchmarks/endings.py [--endings 60] [--seed 0] [HOW ...]

A robot publishes states and inputs at 250 Hz, with its quality of service, and notes when it sent
each. `leo bag record` is ended by SIGINT, SIGTERM, SIGKILL, both signals after it was stopped for
up to 6 s, and on a full disk (a limit of the size of files). What was sent between the first
message in the bag and the ending must be in the bag, or be said by the recorder; what a killed one
had in hand for 0.15 s or less may be missing.
"""

from __future__ import annotations

import argparse
from collections import Counter
import json
import os
from pathlib import Path
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from typing import NamedTuple

from mcap.records import Channel, Message, Metadata
from rclpy.node import Node
from sensor_msgs.msg import JointState

from leo_learner.demo.processes import free_domain
from leo_msgs_py import topics
from leo_msgs_py.mcap_file import find_files, McapFile
from leo_msgs_py.node import graph, spare_collector
from leo_msgs_py.terminal import leo_process

PERIOD, PATIENCE, IN_HAND, KILLED = 0.004, 60.0, 0.15, -signal.SIGKILL
TOPICS = topics.JOINT_STATES, topics.APPLIED['voltage']


class Robot:
    """A loop that publishes; `sent` has when it sent each message of a topic [s, monotonic]."""

    def __init__(self) -> None:
        self._node = Node('robot')
        self._out = {
            f'/{t.name}': self._node.create_publisher(t.type, t.name, topics.DEEP) for t in TOPICS
        }
        self._message = JointState(name=['pivot'], position=[0.1], velocity=[0.2], effort=[0.3])
        self.sent: dict[str, list[float]] = {name: [] for name in self._out}
        self.longest = 0.0

    def run(self, seconds: float) -> None:
        """Publish so long."""
        end = time.monotonic() + seconds
        while (now := time.monotonic()) < end:
            stamp = time.time_ns()
            self._message.header.stamp.sec, left = divmod(stamp, 10**9)
            self._message.header.stamp.nanosec = left
            for name, publisher in self._out.items():
                publisher.publish(self._message)
                self.sent[name].append(time.monotonic())
            self.longest = max(self.longest, time.monotonic() - now)
            time.sleep(PERIOD)

    def run_until_ended(self, process: subprocess.Popen) -> None:
        """Publish as long as a recorder runs."""
        end = time.monotonic() + PATIENCE
        while process.poll() is None and time.monotonic() < end:
            self.run(0.02)

    def meets(self, bag: Path) -> None:
        """Publish until both topics are in a bag."""
        end = time.monotonic() + PATIENCE
        while min(map(len, numbers(bag).values()), default=0) < 5:
            assert time.monotonic() < end, 'nothing is recorded'
            self.run(0.1)


def numbers(bag: Path) -> dict[str, set[int]]:
    """The publisher's numbers of what a bag holds, of both topics."""
    found: dict[str, set[int]] = {f'/{t.name}': set() for t in TOPICS}
    for file in find_files(bag) if any(bag.glob('*.mcap')) else []:
        names = {}
        for record in McapFile(file).records():
            if isinstance(record, Channel):
                names[record.id] = record.topic
            elif isinstance(record, Message) and names[record.channel_id] in found:
                found[names[record.channel_id]].add(record.sequence)
    return found


def said_by(bag: Path) -> int:
    """How many messages a bag says were lost."""
    records = [r for file in find_files(bag) for r in McapFile(file).records()]
    facts = [r.metadata for r in records if isinstance(r, Metadata) and r.name == 'leo']
    return int(facts[-1].get('lost', 0)) if facts else 0


def interrupt(robot: Robot, recorder: subprocess.Popen) -> float:
    """SIGINT."""
    recorder.send_signal(signal.SIGINT)
    return time.monotonic()


def terminate(robot: Robot, recorder: subprocess.Popen) -> float:
    """SIGTERM."""
    recorder.send_signal(signal.SIGTERM)
    return time.monotonic()


def kill(robot: Robot, recorder: subprocess.Popen) -> float:
    """SIGKILL."""
    recorder.kill()
    return time.monotonic()


def stand_still(robot: Robot, recorder: subprocess.Popen) -> float:
    """SIGSTOP, and a signal that ends it before or after SIGCONT."""
    recorder.send_signal(signal.SIGSTOP)
    robot.run(random.choice([random.uniform(0.1, 1.5), random.uniform(2.5, 6.0)]))
    how, before = random.choice([signal.SIGINT, signal.SIGTERM]), random.random() < 0.5
    if before:
        recorder.send_signal(how)
    ended = time.monotonic()
    recorder.send_signal(signal.SIGCONT)
    if not before:
        robot.run(random.uniform(0.0, 0.5))
        ended = time.monotonic()
        recorder.send_signal(how)
    return ended


def fill(robot: Robot, recorder: subprocess.Popen) -> float:
    """No file may grow any more, for a while or for good."""
    _, most = resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE)
    room = 8192 + random.randrange(20000)
    size = max(file.stat().st_size for file in Path(recorder.args[-1]).iterdir())
    resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (size + room, most))
    robot.run(random.uniform(0.1, 1.5))
    if random.random() < 0.5:
        resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (most, most))
        robot.run(random.uniform(0.0, 0.5))
    return interrupt(robot, recorder)


HOWS = {'INT': interrupt, 'TERM': terminate, 'KILL': kill, 'STOP': stand_still, 'full': fill}
DROPPED = 'STOP', 'full'
"""Endings in which messages may be lost if it is said."""


class Ending(NamedTuple):
    """One, counted: messages sent meanwhile, in the bag, lost and said, lost and unsaid."""

    how: str
    sent: int
    held: int
    said: int
    unsaid: int
    status: int


def ended(robot: Robot, how: str, bag: Path) -> Ending:
    """Record, end, count."""
    words = leo_process('bag', 'record', '--json', '-o', str(bag))
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.DEVNULL, 'text': True}
    recorder = subprocess.Popen(words, **pipes)
    robot.meets(bag)
    robot.run(random.uniform(0.2, 1.5))
    at = HOWS[how](robot, recorder)
    robot.run_until_ended(recorder)
    return counted(robot, how, bag, at, recorder)


def counted(robot: Robot, how: str, bag: Path, at: float, recorder: subprocess.Popen) -> Ending:
    """What became of what was sent until the ending."""
    held, missing = numbers(bag), []
    first = {name: min(found) for name, found in held.items()}
    sent = {
        name: [n for n, when in enumerate(times, 1) if n >= first[name] and when < at]
        for name, times in robot.sent.items()
    }
    for name, found in held.items():
        missing += [robot.sent[name][n - 1] for n in sent[name] if n not in found]
    told = recorder.stdout.read()
    said = json.loads(told)['lost'] if told else said_by(bag)
    if how == 'KILL':
        missing = [when for when in missing if when < at - IN_HAND]
    if told and (said > 0) != (recorder.returncode == 1 and said_by(bag) == said):
        print(f'{how}: says {said} with exit status {recorder.returncode}, bag {said_by(bag)}')
    in_bag = sum(len(set(sent[name]) & found) for name, found in held.items())
    total, unsaid = sum(map(len, sent.values())), max(0, len(missing) - said)
    return Ending(how, total, in_bag, said, unsaid, recorder.returncode)


def main() -> int:
    """End and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('hows', nargs='*', help=f'of {", ".join(HOWS)}')
    parser.add_argument('--endings', type=int, default=60)
    parser.add_argument('--seed', type=int, default=0)
    options = parser.parse_args()
    random.seed(options.seed)
    names = options.hows or list(HOWS)
    hows = [names[k % len(names)] for k in range(options.endings)]
    random.shuffle(hows)
    with free_domain() as domain, tempfile.TemporaryDirectory() as folder:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        with graph(['--ros-args', '--log-level', 'error']):
            robot, found = Robot(), []
            spare_collector()
            for k, how in enumerate(hows):
                found.append(ended(robot, how, Path(folder, f'bag{k}')))
                print(f'{k + 1}/{len(hows)} {told(found[-1])}', flush=True)
    return summed(found, robot.longest)


def told(e: Ending) -> str:
    """One line."""
    return (
        f'{e.how}: {e.sent} sent, {e.held} in the bag, {e.said} lost and said, '
        f'{e.unsaid} lost and unsaid, exit {e.status}'
    )


def summed(found: list[Ending], longest: float) -> int:
    """A line for each way and for all; 1 where something was lost that may not be."""
    for how in sorted({e.how for e in found}):
        rows = [e for e in found if e.how == how]
        total = [sum(e[k] for e in rows) for k in range(1, 5)]
        exits = dict(Counter(e.status for e in rows))
        print(f'{len(rows)} times {told(Ending(how, *total, 0))[:-8]}, exits {exits}')
    unsaid = sum(e.unsaid for e in found)
    undue = sum(e.said for e in found if e.how not in DROPPED)
    print(
        f'{len(found)} endings: lost and unsaid {unsaid}, lost and said where nothing was dropped '
        f'{undue}; longest turn of the robot {1e3 * longest:.0f} ms'
    )
    return int(unsaid + undue > 0)


if __name__ == '__main__':
    sys.exit(main())
