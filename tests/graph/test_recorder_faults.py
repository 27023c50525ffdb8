# SPDX-License-Identifier: Apache-2.0
"""The recording node says on /diagnostics what goes wrong around it, and goes on."""

from collections.abc import Callable
import resource
import shutil

from diagnostic_msgs.msg import DiagnosticStatus
import pytest
from rclpy.serialization import deserialize_message
from tests.graph.test_recorder_node import PATIENCE, PENDULUM, Robot, start_recorder, stop

from leo_diffmodel.bags.contents import load
from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py import topics
from leo_msgs_py.node import graph, spin_until
from leo_msgs_py.serialized import Taken, taken

pytestmark = pytest.mark.graph
FEW = 2000
"""More room than nothing: a part of what is written at once [bytes]."""


class Stage:
    """Robots of this process, and what the recorder says of itself."""

    def __init__(self) -> None:
        self.robot = Robot()
        self.said = DiagnosticStatus()
        kind, name, qos = topics.DIAGNOSTICS
        self.robot.node.create_subscription(kind, name, self._hear, qos)

    def _hear(self, message) -> None:
        for status in message.status:
            if status.name.endswith('recording'):
                self.said = status

    def until(self, condition: Callable[[], bool]) -> None:
        """Swing until something holds, but not for ever."""
        for _ in range(12_000):
            if condition():
                return
            self.robot.tick()
        raise AssertionError(self.said)

    def number(self, key: str) -> int:
        return next(int(v.value) for v in self.said.values if v.key == key)


@pytest.fixture
def stage(domain):
    with graph(['--ros-args', '--log-level', 'warn']):
        yield Stage()


def test_a_full_disk_is_said_and_recording_goes_on_when_there_is_room(
    stage, tmp_path, spawn, monkeypatch
):
    bag = tmp_path / 'bag'
    # A file size limit holds for shared memory, too; a port that is cut short ends its readers.
    monkeypatch.setenv('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')
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


def test_a_removed_folder_is_said_while_it_is_recorded(stage, tmp_path, spawn):
    recorder = start_recorder(spawn, tmp_path / 'bag')
    stage.robot.wait_for_reader()
    stage.until(lambda: (tmp_path / 'bag').exists())
    shutil.rmtree(tmp_path / 'bag')
    stage.until(lambda: 'moved or removed' in stage.said.message)
    assert stage.said.level == DiagnosticStatus.WARN
    stage.until(lambda: stage.number('messages') > 200)
    stop(recorder)
    assert load(tmp_path / 'bag').finished


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
