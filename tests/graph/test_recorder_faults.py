# SPDX-License-Identifier: Apache-2.0
"""The recording node says on /diagnostics what goes wrong around it, and goes on."""

from collections.abc import Callable
import resource
import shutil

from diagnostic_msgs.msg import DiagnosticStatus
import pytest
from tests.graph.test_recorder_node import PENDULUM, Robot, start_recorder, stop

from leo_diffmodel.bags.contents import load
from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py import topics
from leo_msgs_py.node import graph

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


def test_two_robots_are_said_and_one_is_kept(stage, tmp_path, spawn):
    recorder = start_recorder(spawn, tmp_path / 'bag')
    first = stage.robot
    first.wait_for_reader()
    stage.until(lambda: first.count >= 150)
    second = Robot()
    second.wait_for_reader()
    for _ in range(150):
        first.tick()
        second.tick()
    stage.until(lambda: 'two robots' in stage.said.message)
    assert stage.said.level == DiagnosticStatus.WARN and stage.number('of another robot') > 100
    stage.until(lambda: stage.said.level == DiagnosticStatus.OK)
    stop(recorder)
    bags = sorted(tmp_path.glob('bag*'))
    kept = [len(load(b).topics['/joint_states'].messages) for b in bags if b.suffix == '']
    assert len(kept) <= 3 and sum(kept) >= first.count - 3
