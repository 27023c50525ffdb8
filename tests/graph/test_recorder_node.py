# SPDX-License-Identifier: Apache-2.0
"""The recording node and `leo bag record|play`, as processes of a live graph; what goes wrong."""

from collections.abc import Callable, Iterator
import json
import math
import os
from pathlib import Path
import resource
import signal
import subprocess
import time

from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np
import pytest
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from std_msgs.msg import UInt32
from tests import live_bag
from tests.commands import start, start_node
from tests.patience import PATIENCE, until
from tests.simulate import PENDULUM

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.info import bag_info
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.nodes.robot_facts import FACTS, RobotFacts
from leo_msgs_py import topics
from leo_msgs_py.bag_contents import load
from leo_msgs_py.node import graph, join, listen, private_parameter, spin_once, spin_until
from leo_msgs_py.serialized import Taken, taken
from leo_msgs_py.values import Applied, JointStates

pytestmark = pytest.mark.graph

APPLIED = topics.APPLIED['voltage']
PERIOD = 0.01


class Robot:
    def __init__(self) -> None:
        self.node = Node('robot')
        said = 'pendulum', 'nominal', [0.0, 0.0], 7, 1.0
        for name, value in zip(FACTS, said, strict=True):
            self.node.declare_parameter(name, value)
        private_parameter(self.node, 'hidden', '')
        join(self.node)
        self._states = self.node.create_publisher(*topics.JOINT_STATES[:2], topics.LOSSLESS)
        self._applied = self.node.create_publisher(*APPLIED[:2], topics.LOSSLESS)
        self._episode = self.node.create_publisher(*topics.EPISODE)
        self._episode.publish(UInt32(data=1))
        self.count = 0

    def until(self, condition: Callable[[], bool]) -> None:
        assert spin_until(condition, PATIENCE)

    def wait_for_reader(self) -> None:
        self.until(lambda: self._states.get_subscription_count() > 0)
        self.until(lambda: self._applied.get_subscription_count() > 0)

    def tick(self) -> None:
        stamp, t = self.count * 10_000_000, self.count * PERIOD
        angle, rate = np.array([math.sin(t)]), np.array([math.cos(t)])
        self._states.publish(JointStates(stamp, ('pivot',), angle, rate).to_message())
        self._applied.publish(Applied(stamp, ('pivot',), np.array([t])).to_message())
        self.count += 1
        spin_once(PERIOD)

    def swing(self, bag: Path, count: int) -> None:
        """Go on until so many states and inputs were published, and all of them are in the bag."""
        while self.count < count:
            self.tick()
        self.until(lambda: on_disk(bag) == (count, count))
        self.until(lambda: live_bag.says(bag, 'robot'))

    def restart(self) -> None:
        self.count = 0
        self._episode.publish(UInt32(data=2))


@pytest.fixture
def robot(spawn) -> Iterator[Robot]:
    with graph(['--ros-args', '--log-level', 'warn', '-p', 'hidden:=secret']):
        yield Robot()


def on_disk(bag: Path) -> tuple[int, int]:
    found = live_bag.counts(bag)
    return found.get('/joint_states', 0), found.get('/robot/applied_voltage', 0)


def start_recorder(spawn, bag: Path, **options) -> subprocess.Popen:
    return start_node(spawn, 'leo_diffmodel', 'diffmodel', f'bag:={bag}', **options)


def stop(process: subprocess.Popen) -> None:
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 0


def test_a_rollout_becomes_a_bag_and_a_restart_the_next(tmp_path, robot, spawn):
    recorder = start_recorder(spawn, tmp_path / 'bag')
    robot.wait_for_reader()
    robot.swing(tmp_path / 'bag', 200)
    robot.restart()
    robot.swing(tmp_path / 'bag_1', 100)
    stop(recorder)
    first, second = read_bag(tmp_path / 'bag', PENDULUM), read_bag(tmp_path / 'bag_1', PENDULUM)
    assert first.warnings == second.warnings == ()
    assert [len(e.t) for e in first.episodes + second.episodes] == [200, 100]
    expected = np.arange(200) * PERIOD
    np.testing.assert_allclose(first.episodes[0].q[:, 0], np.sin(expected), atol=1e-12)
    np.testing.assert_allclose(first.episodes[0].inputs[:, 0], expected, atol=1e-12)
    assert first.metadata['robot'] == 'pendulum' and first.metadata['seed'] == '7'
    for name in ('bag', 'bag_1'):
        assert load(tmp_path / name).finished and (tmp_path / name / 'metadata.yaml').is_file()
        assert not any(b'secret' in f.read_bytes() for f in (tmp_path / name).iterdir())


def test_a_killed_recorder_starts_again_and_its_bag_is_finished(tmp_path, robot, spawn):
    recorder = start_recorder(spawn, tmp_path / 'bag')
    robot.wait_for_reader()
    robot.swing(tmp_path / 'bag', 150)
    os.kill(recorder.pid, signal.SIGKILL)
    recorder.wait()
    assert on_disk(tmp_path / 'bag') == (150, 150)
    recorder = start_recorder(spawn, tmp_path / 'bag')
    until(lambda: (tmp_path / 'bag' / 'metadata.yaml').is_file())
    assert bag_info(tmp_path / 'bag').state == 'finished'
    end = time.monotonic() + PATIENCE
    while not _goes_on(tmp_path / 'bag_1') and time.monotonic() < end:
        for _ in range(10):
            robot.tick()
    stop(recorder)
    again = read_bag(tmp_path / 'bag_1', PENDULUM)
    assert len(again.episodes) == 1 and len(again.episodes[0].t) >= 50
    assert len(load(tmp_path / 'bag_1').topics['/robot/episode'].messages) == 1


def test_a_recorder_that_is_ended_takes_what_waits_first(tmp_path, robot, spawn):
    recorder = start_recorder(spawn, tmp_path / 'bag')
    robot.wait_for_reader()
    robot.swing(tmp_path / 'bag', 50)
    recorder.send_signal(signal.SIGSTOP)
    while robot.count < 150:
        robot.tick()
    recorder.send_signal(signal.SIGINT)
    recorder.send_signal(signal.SIGCONT)
    assert recorder.wait(PATIENCE) == 0 and on_disk(tmp_path / 'bag') == (150, 150)


def _goes_on(bag: Path) -> bool:
    """Whether half a second is there, and the episode, whose publisher may be found later."""
    return min(on_disk(bag)) > 50 and live_bag.counts(bag).get('/robot/episode', 0) > 0


def test_a_robot_that_says_only_which_it_is_is_named(node):
    robot = join(Node('robot'))
    robot.declare_parameter('robot', 'pendulum')
    facts = RobotFacts(node)
    assert spin_until(lambda: facts.poll().get('robot') == 'pendulum', PATIENCE)


def test_a_played_bag_is_recorded_as_it_was(tmp_path, node, spawn):
    t = np.arange(150) * PERIOD
    inputs = {'pivot': {'voltage': np.sin(9 * t), 'enabled': np.ones(len(t))}}
    run = Run(t, ['pivot'], np.sin(t)[:, None], np.cos(t)[:, None], inputs=inputs)
    source = write_runs(tmp_path / 'source', [run], {'robot': 'pendulum'})
    recorded = '/joint_states', '/robot/applied_voltage', 'robot/episode'
    words = 'bag', 'record', '-o', str(tmp_path / 'copy'), *recorded, '--json'
    recorder = start(spawn, *words, stdout=subprocess.PIPE)
    assert spin_until(lambda: node.count_subscribers('/robot/applied_voltage') > 0, PATIENCE)
    began = time.monotonic()
    words = 'bag', 'play', str(source), '--wait', str(PATIENCE), '--json'
    player = start(spawn, *words, stdout=subprocess.PIPE)
    out, _ = player.communicate(timeout=2 * PATIENCE)
    assert player.returncode == 0 and time.monotonic() - began > 1.49
    original = load(source)
    count = sum(len(topic.messages) for topic in original.topics.values())
    assert json.loads(out) == {'bag': str(source), 'messages': count}
    until(lambda: live_bag.counts(tmp_path / 'copy') == live_bag.counts(source))
    stop(recorder)
    copy, told = load(tmp_path / 'copy'), json.loads(recorder.stdout.read())
    assert told['bag'] == str(tmp_path / 'copy') and (told['lost'], told['foreign']) == (0, 0)
    assert told['messages'] == sum(len(topic.messages) for topic in copy.topics.values())
    for name, topic in original.topics.items():
        assert [m.data for m in copy.topics[name].messages] == [m.data for m in topic.messages]
        assert copy.topics[name].qos == topic.qos


FEW = 2000  # more room than nothing: a part of what is written at once [bytes]


class Stage:
    """Robots of this process, and what the recorder says of itself."""

    def __init__(self) -> None:
        self.robot = Robot()
        self.said = DiagnosticStatus()
        listen(self.robot.node, topics.DIAGNOSTICS, self._hear)

    def _hear(self, message) -> None:
        for status in message.status:
            if status.name.endswith('recording'):
                self.said = status

    def until(self, condition: Callable[[], bool]) -> None:
        for _ in range(12_000):
            if condition():
                return
            self.robot.tick()
        raise AssertionError(self.said)

    def number(self, key: str) -> int:
        return next(int(v.value) for v in self.said.values if v.key == key)


@pytest.fixture
def stage(spawn):
    with graph(['--ros-args', '--log-level', 'warn']):
        yield Stage()


def test_a_full_disk_is_said_and_recording_goes_on_when_there_is_room(stage, tmp_path, spawn):
    bag = tmp_path / 'bag'
    recorder = start_recorder(spawn, bag)
    stage.robot.wait_for_reader()
    stage.until(lambda: stage.said.message.startswith('recording'))
    stage.until(lambda: stage.number('messages') > 99)
    _, most = resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE)
    size = sum(file.stat().st_size for file in bag.iterdir())
    resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (size + FEW, most))
    stage.until(lambda: stage.said.level == DiagnosticStatus.ERROR and stage.number('lost') > 100)
    assert 'File too large' in stage.said.message and str(bag) in stage.said.message
    resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (most, most))
    stage.until(lambda: stage.said.level == DiagnosticStatus.OK)
    before = stage.number('messages')
    stage.until(lambda: stage.number('messages') > before + 200)
    stop(recorder)
    contents, recording = load(bag), read_bag(bag, PENDULUM)
    assert contents.finished and not contents.damaged
    assert len(recording.episodes) == 2
    assert any('were lost while it was recorded' in text for text in recording.warnings)


def test_two_robots_are_said_and_the_first_is_kept(stage, tmp_path, spawn):
    log = (tmp_path / 'log').open('w')
    recorder = start_recorder(spawn, tmp_path / 'bag', stderr=log, stdout=log)
    first = stage.robot
    first.wait_for_reader()
    stage.until(lambda: first.count >= 150)
    second = Robot()
    second.wait_for_reader()
    for _ in range(2):  # it falls silent for longer than it is told
        for _ in range(20):
            first.tick()
            second.tick()
        stage.until(lambda: 'two robots' in stage.said.message)
        assert stage.said.level == DiagnosticStatus.WARN
        stage.until(lambda: stage.said.level == DiagnosticStatus.OK)
    assert stage.number('of another robot') == 80
    stop(recorder)
    assert sorted(path.name for path in tmp_path.glob('bag*')) == ['bag']
    for topic in ('/joint_states', '/robot/applied_voltage'):
        assert len(load(tmp_path / 'bag').topics[topic].messages) == first.count
    assert (tmp_path / 'log').read_text().count('two robots publish') == 1


def test_a_message_comes_with_the_gid_of_its_publisher(stage):
    node = stage.robot.node
    kind, name, _ = topics.JOINT_STATES
    with_raw = node.create_subscription(kind, name, lambda _: None, topics.LOSSLESS, raw=True)
    publishers = [node.create_publisher(kind, name, topics.LOSSLESS) for _ in range(2)]
    assert spin_until(lambda: with_raw.handle.get_publisher_count() == 3, PATIENCE)
    sent = [kind(name=['pivot'] * size) for size in (1, 2, 9999)]
    for message in sent:
        for publisher in publishers:
            publisher.publish(message)
    found: list[Taken] = []
    assert spin_until(lambda: found.extend(taken(with_raw)) or len(found) == 6, PATIENCE)
    known = {bytes(each.endpoint_gid) for each in node.get_publishers_info_by_topic(name)}
    by_gid = {gid: [m for m in found if m.publisher == gid] for gid in known}
    assert sorted(map(len, by_gid.values())) == [0, 3, 3]
    for messages in filter(None, by_gid.values()):
        assert [deserialize_message(m.data, kind) for m in messages] == sent
        assert [m.number for m in messages] == [1, 2, 3]
        assert all(0 < m.published_ns <= m.received_ns for m in messages)
