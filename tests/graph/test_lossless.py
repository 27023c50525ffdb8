# SPDX-License-Identifier: Apache-2.0
"""Nothing is lost in lockstep: not beside a recorder, not while one stands still."""

from contextlib import suppress
from pathlib import Path
import signal
import subprocess
from threading import Timer
import time

import numpy as np
import pytest
from std_msgs.msg import UInt32
from tests import live_bag
from tests.commands import start, start_node
from tests.patience import PATIENCE
from tests.simulate import PENDULUM

from leo_diffmodel.bags.recorder import header_stamp
from leo_learner.robot.env import RobotEnv
from leo_msgs_py import topics
from leo_msgs_py.bag_contents import load
from leo_msgs_py.node import spin_until

pytestmark = pytest.mark.graph
APPLIED = topics.APPLIED['voltage']
FAST = 1000  # states per second: 50 of them for each command


@pytest.fixture
def recorded(node, spawn, tmp_path):
    """A robot in lockstep as an environment, and the process that records it into a bag."""
    words = 'robot:=pendulum', 'realtime_factor:=0', f'state_rate:={FAST}', 'engine:=rigid'
    start_node(spawn, 'leo_sim', 'robot', *words)
    bag = tmp_path / 'bag'
    recorder = start(spawn, 'bag', 'record', '-o', str(bag), stdout=subprocess.PIPE)
    env = RobotEnv(node, PENDULUM)
    env.reset()
    while not live_bag.has(bag, topics.JOINT_STATES, APPLIED):
        env.step(np.zeros(1))
    return env, recorder, bag


def stamps(bag: Path, topic: topics.Topic) -> np.ndarray:
    """Stamps [ns] of the messages of a topic, repeated ones once."""
    return np.unique([header_stamp(m.data) for m in load(bag).topics[f'/{topic.name}'].messages])


def test_a_recorder_that_stands_still_for_a_second_loses_nothing(recorded):
    env, recorder, bag = recorded
    begin, period = env._state.stamp_ns, round(1e9 / FAST)
    recorder.send_signal(signal.SIGSTOP)
    going_on = Timer(1.0, recorder.send_signal, [signal.SIGCONT])
    going_on.start()
    while going_on.is_alive():
        env.step(np.ones(1))
    end = env._state.stamp_ns
    while min(live_bag.newest(bag, topic) for topic in (topics.JOINT_STATES, APPLIED)) < end:
        assert recorder.poll() is None
        env.step(np.zeros(1))
    recorder.send_signal(signal.SIGINT)
    assert recorder.wait(PATIENCE) == 0
    for topic in (topics.JOINT_STATES, APPLIED):
        found = stamps(bag, topic)
        assert np.isin(np.arange(begin, end, period), found).all(), topic.name


READER = """
import sys, time
from rclpy.node import Node
from std_msgs.msg import UInt32
from leo_msgs_py import topics
from leo_msgs_py.node import graph

with graph():
    node = Node('reader')  # no executor serves it
    reader = node.create_subscription(UInt32, 'numbers', lambda _: None, topics.LOSSLESS)
    count, taken = int(sys.stdin.readline()), []
    while len(taken) < count:
        while (found := reader.handle.take_message(UInt32, False)) is not None:
            taken.append(found[0].data)
        time.sleep(0.01)
    print(taken == list(range(count)))
    node.destroy_node()
"""


def test_a_full_reader_holds_the_writer_up_until_it_takes(node, spawn):
    reader = spawn('-c', READER, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    writer = node.create_publisher(UInt32, 'numbers', topics.LOSSLESS)
    assert spin_until(lambda: writer.get_subscription_count() > 0, PATIENCE)
    sent: list[int] = []

    def send(count: int) -> None:
        for _ in range(count):
            writer.publish(UInt32(data=len(sent)))
            sent.append(len(sent))

    with pytest.raises(RuntimeError):
        send(50_000)
    assert len(sent) > 1000
    reader.stdin.write(f'{len(sent) + 10}\n')
    reader.stdin.flush()
    end = time.monotonic() + PATIENCE
    goal = len(sent) + 10
    while len(sent) < goal:
        with suppress(RuntimeError):
            send(1)
        assert time.monotonic() < end
    assert reader.communicate(timeout=PATIENCE)[0] == 'True\n'
