# SPDX-License-Identifier: Apache-2.0
"""The last seconds of a robot's messages, and one line on how it is."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.simulate import TORQUE

from leo_diffmodel.bags.cut import write_contents
from leo_diffmodel.bags.recording import assembled, read_bag
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.bags.types import APPLIED, EPISODE, STATES
from leo_diffmodel.watch.live import buffer as module
from leo_diffmodel.watch.live.buffer import Condition, MessageBuffer, SILENT
from leo_msgs_py import cdr

JOINTS = tuple(TORQUE.joint_names)


def say(buffer, k, q=None, publisher=b'robot', base=0):
    stamp = base + k * 10_000_000
    value = np.sin(0.01 * k) if q is None else q
    state = cdr.joint_state(stamp, JOINTS, [value], [np.cos(0.01 * k)])
    logged = 10**18 + k * 10_000_000
    buffer.record(STATES, state, 0, logged, k, publisher)
    applied = cdr.joint_state(stamp, JOINTS, effort=[0.1])
    buffer.record(APPLIED['effort'], applied, 0, logged + 1, k, publisher)


@pytest.fixture
def buffer():
    buffer = MessageBuffer(2.0)
    buffer.record(EPISODE, cdr.uint32(1), 0, 10**18)
    return buffer


def test_it_keeps_the_last_seconds_and_what_is_latched(buffer):
    for k in range(1000):
        say(buffer, k)
    topics = buffer.contents().topics
    assert 200 <= len(topics[STATES.name].messages) <= 202
    assert len(topics[EPISODE.name].messages) == 1


def test_its_states_are_those_that_a_bag_of_it_would_give(buffer, tmp_path):
    for k in range(300):
        say(buffer, k)
    live = assembled(buffer.contents(), TORQUE, TopicMap())
    write_contents(buffer.contents(), tmp_path / 'bag')
    kept = read_bag(tmp_path / 'bag', TORQUE)
    for name in ('t', 'q', 'dq', 'inputs', 'enabled'):
        np.testing.assert_array_equal(*(getattr(r.episodes[0], name) for r in (live, kept)))


def test_of_two_robots_one_is_kept_and_it_is_said(buffer):
    for k in range(50):
        say(buffer, k)
        if k > 10:
            say(buffer, k, q=3.0, publisher=b'other', base=10**15)
    assert buffer.two and buffer.foreign
    episodes = assembled(buffer.contents(), TORQUE, TopicMap()).episodes
    assert max(e.q.max() for e in episodes) < 3.0


def test_silence_comes_before_all_else_and_then_what_the_robot_says(monkeypatch):
    now = 100.0
    monkeypatch.setattr(module, 'time', SimpleNamespace(monotonic=lambda: now))
    buffer = MessageBuffer(10.0)
    condition = Condition(e_stopped=True, message='e-stop: 0 V', level=2)
    buffer.last_state = now
    assert condition.line(buffer) == (False, 'e-stop: 0 V')
    buffer.last_state -= SILENT + 1.5
    well, text = condition.line(buffer)
    assert not well and 'no state from the robot for 3 s' in text
    buffer.last_state = now
    assert Condition(message='running').line(buffer) == (True, 'running')
    assert Condition(trouble='not shown: x').line(buffer) == (False, 'not shown: x')
