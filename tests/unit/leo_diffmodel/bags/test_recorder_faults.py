# SPDX-License-Identifier: Apache-2.0
"""What goes wrong around a recorder: full disks, removed folders, second robots, set clocks."""

import errno
import os
from pathlib import Path
import shutil

import numpy as np
import pytest
from tests.simulate import PENDULUM

from leo_diffmodel.bags import recorder as recording
from leo_diffmodel.bags import writer
from leo_diffmodel.bags.arrival import ArrivalTimes
from leo_diffmodel.bags.finish import BagState, finish_bag, finish_left_over
from leo_diffmodel.bags.info import bag_info
from leo_diffmodel.bags.recorder import Recorder, TWO
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.types import APPLIED, EPISODE, STATES, to_yaml, Topic
from leo_diffmodel.bags.writer import BagWriter
from leo_diffmodel.verbs.bag import main
from leo_msgs_py.bag_contents import load
from leo_msgs_py.cdr import decode, joint_state, uint32
from leo_msgs_py.errors import UserError
from leo_msgs_py.mcap_file import find_files

VOLTS = APPLIED['voltage']
PERIOD = 10_000_000


def state(stamp_ns: int, q: float = 0.0, joint: str = 'pivot') -> bytes:
    return joint_state(stamp_ns, [joint], [q], [0.0])


def no_room(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


class Disk:
    """`os.write` of a disk that has room for so many bytes, and takes what fits of a write."""

    def __init__(self, room: float) -> None:
        self.room = room

    def __call__(self, file: int, data: bytes) -> int:
        fits = int(min(self.room, len(data)))
        if not fits:
            no_room()
        self.room -= fits
        return WRITE(file, data[:fits])


WRITE = os.write


@pytest.fixture
def disk(monkeypatch) -> Disk:
    full = Disk(float('inf'))
    monkeypatch.setattr(writer.os, 'write', full)
    return full


@pytest.fixture
def clock(monkeypatch) -> list[float]:
    """The monotonic time [s] of the recorder, set by the test."""
    now = [1000.0]
    monkeypatch.setattr(recording.time, 'monotonic', lambda: now[0])
    return now


def send(recorder: Recorder, numbers: range) -> None:
    for k in numbers:
        recorder.record(STATES, state(k * PERIOD, 0.01 * k), logged_ns=1 + k * PERIOD)
        recorder.flush()


def stamps(bag: Path) -> list[int]:
    messages = load(bag).topics['/joint_states'].messages
    decoded = (decode(m.data, STATES.type) for m in messages)
    return [round((d.header.stamp.sec * 10**9 + d.header.stamp.nanosec) / PERIOD) for d in decoded]


@pytest.mark.parametrize('room', [0, 1, 37, 500])
def test_a_full_disk_costs_what_came_meanwhile_and_nothing_else(room, tmp_path, recorder, disk):
    recorder.describe({'robot': 'pendulum'})
    recorder.record(EPISODE, uint32(1))
    send(recorder, range(50))
    disk.room = room
    send(recorder, range(50, 80))
    assert 'No space left' in recorder.full and recorder.lost >= 25
    assert any('messages are lost' in text for text in recorder.troubles)
    recorder.record(EPISODE, uint32(2))
    disk.room = float('inf')
    recorder.flush()
    assert recorder.full == '' and recorder.troubles == []
    send(recorder, range(80, 120))
    recorder.close()
    kept = stamps(tmp_path / 'bag')
    states_lost = 120 - len(kept)
    assert kept == [*range(80 - states_lost), *range(80, 120)]
    assert recorder.lost == states_lost + 1 and recorder.messages == len(kept) + 1
    assert finish_bag(tmp_path / 'bag') is BagState.FINISHED
    contents = load(tmp_path / 'bag')
    assert contents.damaged == 0
    latched = contents.topics['/robot/episode'].messages
    numbers = [decode(m.data, EPISODE.type).data for m in latched]
    assert (numbers[0], numbers[-1]) == (1, 2)
    warnings = read_bag(tmp_path / 'bag', PENDULUM).warnings
    assert any(f'{recorder.lost} messages were lost' in warning for warning in warnings)


def test_a_disk_that_stays_full_leaves_a_bag_that_reads(tmp_path, recorder, disk):
    send(recorder, range(50))
    disk.room = 30
    send(recorder, range(50, 80))
    recorder.close()
    kept = stamps(tmp_path / 'bag')
    assert kept[:50] == [*range(50)] and len(kept) == recorder.messages
    assert recorder.messages + recorder.lost == 80
    disk.room = float('inf')
    assert bag_info(tmp_path / 'bag').state == 'repaired'


def test_a_restart_on_a_full_disk_waits_for_room_for_its_bag(tmp_path, disk, monkeypatch):
    recorder = Recorder(tmp_path / 'bag')
    send(recorder, range(100))
    disk.room = 0
    with monkeypatch.context() as patch:
        patch.setattr(Path, 'mkdir', no_room)
        send(recorder, range(20))
        assert 'No space left' in recorder.full
    disk.room = float('inf')
    recorder.flush()
    send(recorder, range(20, 60))
    recorder.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'bag_1']
    assert stamps(tmp_path / 'bag_1') == [*range(20, 60)] and recorder.lost == 20
    assert load(tmp_path / 'bag_1').metadata['leo'] == {'lost': '20'}
    assert main(['info', str(tmp_path / 'bag_1')]) == 1


def test_a_file_that_cannot_be_made_leaves_no_folder(tmp_path, monkeypatch):
    monkeypatch.setattr('leo_diffmodel.bags.writer.Spool', no_room)
    with pytest.raises(UserError, match=r'cannot write to .*bag: No space left'):
        BagWriter(tmp_path / 'bag')
    assert list(tmp_path.iterdir()) == []


def test_no_room_to_finish_a_left_over_bag_leaves_it_as_it_was(tmp_path, unfinished, monkeypatch):
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'bag_0.mcap').write_bytes(unfinished)
    monkeypatch.setattr('leo_diffmodel.bags.finish.os.fsync', no_room)
    assert finish_left_over(tmp_path / 'bag') == []
    assert bag_info(tmp_path / 'bag').state == 'unfinished'
    assert [path.name for path in (tmp_path / 'bag').iterdir()] == ['bag_0.mcap']
    assert (tmp_path / 'bag' / 'bag_0.mcap').read_bytes() == unfinished


def test_a_removed_folder_is_noticed_at_once_and_the_next_bag_begins(tmp_path, recorder):
    recorder.record(EPISODE, uint32(4))
    send(recorder, range(50))
    shutil.rmtree(tmp_path / 'bag')
    recorder.flush()
    assert any('moved or removed' in text for text in recorder.troubles)
    assert (recorder.messages, recorder.lost) == (0, 51)
    send(recorder, range(50, 90))
    recorder.close()
    assert stamps(tmp_path / 'bag') == [*range(50, 90)] and recorder.messages == 40
    assert len(load(tmp_path / 'bag').topics['/robot/episode'].messages) == 1


def test_a_folder_moved_away_keeps_what_it_has_and_the_next_bag_begins(tmp_path, recorder):
    send(recorder, range(50))
    (tmp_path / 'bag').rename(tmp_path / 'away')
    send(recorder, range(50, 90))
    recorder.close()
    found = stamps(find_files(tmp_path / 'away')[0]) + stamps(tmp_path / 'bag')
    assert found == [*range(90)] and recorder.lost == 0


class Graph:
    """A recorder and its robots; the graph knows those that are not killed or ended."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.recorder = folder, Recorder(folder / 'bag')
        self.known, self.now = set(), 1000.0
        self.recorder.publishers = lambda _: self.known

    def robot(self, q: float, start: int = 10**10) -> 'Speaker':
        return Speaker(self, q, start)

    def heard(self, topic: str = '/joint_states') -> list[tuple[int, int]]:
        """How many states of the robots at 1 rad and at 2 rad are in each bag, in order."""
        self.recorder.close()
        found = []
        for bag in sorted(self.folder.iterdir(), key=lambda path: int(path.name[4:] or 0)):
            log = load(bag).topics.get(topic)
            said = [decode(m.data, STATES.type) for m in log.messages] if log else []
            q = [float(np.append(m.position, m.effort)[0]) for m in said]
            found.append((q.count(1.0), q.count(2.0)))
        return found


@pytest.fixture
def graph(tmp_path: Path) -> 'Graph':
    return Graph(tmp_path)


class Speaker:
    """A robot in a test, at q all the time: its stamps begin at `start`."""

    def __init__(self, graph: Graph, q: float, start: int) -> None:
        self.graph, self.q, self.sent, self.start = graph, q, 0, start
        self.gid = os.urandom(16)
        graph.known.add(self.gid)

    def speak(self) -> None:
        self.sent += 1
        stamp, now = self.start + self.sent * PERIOD, round(self.graph.now * 1e9)
        applied = joint_state(stamp, ['pivot'], effort=[self.q])
        for topic, data in ((STATES, state(stamp, self.q)), (VOLTS, applied)):
            self.graph.recorder.record(topic, data, 0, now, self.sent, self.gid)

    def end(self) -> None:
        self.graph.known.remove(self.gid)


def run(graph: Graph, seconds: float, *robots: Speaker) -> None:
    for _ in range(round(100 * seconds)):
        for robot in robots:
            robot.speak()
        graph.now += 0.01


@pytest.mark.parametrize('start', [0, 10**10, 3_600 * 10**9])
@pytest.mark.parametrize('order', [1, -1])
def test_of_two_robots_the_first_goes_on_and_the_other_is_told(start, order, graph, clock):
    """Their stamps may be equal, as those of two simulations started at once."""
    first, second = graph.robot(1.0), graph.robot(2.0, start)
    run(graph, 1.0, first)
    assert graph.recorder.troubles == []
    run(graph, 2.0, *[first, second][::order])
    assert graph.recorder.troubles == [TWO] and graph.recorder.foreign == 400
    clock[0] += 10.0
    run(graph, 1.0, first)
    assert graph.recorder.troubles == [] and graph.recorder.strangers == 1
    for topic in (STATES.name, VOLTS.name):
        assert graph.heard(topic) == [(first.sent, 0)]


@pytest.mark.parametrize('one_publisher', [True, False])
def test_forged_states_cut_no_bag_and_cost_no_state(one_publisher, graph, clock):
    """One every six seconds, each with a stamp of another time."""
    dice = np.random.default_rng(0)
    robot, forger = graph.robot(1.0), graph.robot(2.0)
    for _ in range(10):
        run(graph, 0.1, robot)
        forger = forger if one_publisher else graph.robot(2.0)
        forger.start = int(dice.integers(2 * 10**10))
        forger.speak()
        clock[0] += 6.0
    run(graph, 0.1, robot)
    assert graph.heard() == graph.heard(VOLTS.name) == [(robot.sent, 0)]
    assert graph.recorder.strangers == (1 if one_publisher else 10)


def test_one_that_spoke_beside_a_robot_is_refused_while_that_waits_for_a_command(graph):
    robot, forger = graph.robot(1.0), graph.robot(2.0, 0)
    run(graph, 0.1, robot, forger)
    run(graph, 5.0, forger)
    run(graph, 0.1, robot)
    assert graph.heard() == [(20, 0)]


def test_a_silent_robot_that_goes_on_beside_a_newcomer_is_recorded_again(graph):
    robot, newcomer = graph.robot(1.0), graph.robot(2.0, 0)
    run(graph, 0.1, robot)
    graph.now += 2.0
    run(graph, 0.1, newcomer)
    run(graph, 0.1, robot, newcomer)
    assert graph.heard() == [(10, 0), (0, 10), (10, 0)]


def test_a_stranger_with_other_joints_cuts_no_bag(graph):
    robot = graph.robot(1.0)
    for k in range(10):
        run(graph, 0.1, robot)
        other = state((10 - k) * 10**9, joint='x')
        graph.recorder.record(STATES, other, 0, round(graph.now * 1e9), k, b'stranger')
    assert graph.heard(VOLTS.name) == [(100, 0)]


@pytest.mark.parametrize(
    'order',
    [(1, 2, 4, 5, 3, 6, 7), (1, 3, 2, 4, 5, 7, 6, 8), (1, 2, 6, 4, 5, 3, 7, 8), (1, 2, 5, 6, 7)],
)
def test_states_that_arrive_in_another_order_are_all_recorded(order, tmp_path, recorder):
    for k in order:
        recorder.record(STATES, state(10**10 + k * PERIOD, 0.1 * k), number=k, publisher=b'robot')
    recorder.close()
    assert recorder.foreign == 0 and recorder.lost == max(order) - len(order)
    assert sorted(stamps(tmp_path / 'bag')) == [1000 + k for k in sorted(order)]


def test_a_state_that_is_repeated_is_no_second_robot(tmp_path, recorder):
    for k in range(100):
        recorder.record(STATES, state(k // 10 * PERIOD, 0.1 * (k // 10)))
    recorder.close()
    assert recorder.foreign == 0 and len(stamps(tmp_path / 'bag')) == 100


@pytest.mark.parametrize('has_left', [True, False])
def test_after_the_first_of_two_robots_has_ended_the_other_is_recorded(has_left, graph):
    """At once where the graph says so, else when it would have forgotten a killed one."""
    first, second = graph.robot(1.0), graph.robot(2.0, 0)
    run(graph, 1.0, first, second)
    if has_left:
        first.end()
    run(graph, 22.0, second)
    kept = sum(two for _, two in graph.heard())
    assert 2090 <= kept <= 2110 if has_left else 190 <= kept <= 210


@pytest.mark.parametrize(('pause', 'is_killed'), [(0.0, False), (0.3, False), (1.3, True)])
def test_a_robot_started_again_is_one_robot(pause, is_killed, graph):
    """One that was killed stays in the graph for a while; it takes a second to start another."""
    for _ in range(5):
        robot = graph.robot(1.0, 0)
        run(graph, 1.0, robot)
        graph.now += pause
        if not is_killed:
            robot.end()
    assert graph.heard() == [(100, 0)] * 5
    assert graph.recorder.troubles == [] and graph.recorder.foreign == 0


def test_two_nodes_that_publish_other_joints_are_both_recorded(tmp_path, recorder):
    for k in range(100):
        recorder.record(STATES, state(k * PERIOD, joint='pivot'), publisher=b'arm')
        recorder.record(STATES, state(k * PERIOD, joint='gripper'), publisher=b'gripper')
    recorder.close()
    assert recorder.foreign == 0 and len(stamps(tmp_path / 'bag')) == 200


@pytest.mark.parametrize('jump', [-3_600 * 10**9, 3_600 * 10**9])
def test_a_clock_that_is_set_reorders_nothing(jump, tmp_path, recorder):
    """Takes every 20 ms of states every 2 ms; the wall clock jumps in the middle of one."""
    now = {'steady': 5 * 10**9, 'wall': 1_800_000_000 * 10**9}
    times = ArrivalTimes(lambda: now['wall'], lambda: now['steady'])
    recorder.record(EPISODE, uint32(1), now['wall'], times.logged(now['wall']))
    for take in range(50):
        received = []
        for k in range(10):
            now['steady'] += 2_000_000
            now['wall'] += 2_000_000 + (jump if (take, k) == (25, 5) else 0)
            received.append(now['wall'])
        times.begin()
        times.end()
        logged = [times.logged(at) for at in received]
        assert logged == sorted(logged)
        if take == 30:
            recorder.record(EPISODE, uint32(2), received[0] - 1000, logged[0] - 1000)
        for k, (at, log) in enumerate(zip(received, logged, strict=True)):
            number = 10 * take + k
            recorder.record(STATES, state(number * 2_000_000, 0.001 * number), at, log)
    recorder.close()
    found = read_bag(tmp_path / 'bag', PENDULUM)
    assert [len(e.t) for e in found.episodes] == [300, 200]
    q = np.concatenate([e.q[:, 0] for e in found.episodes])
    np.testing.assert_allclose(q, 0.001 * np.arange(500), atol=1e-12)


def test_what_a_topic_owes_nobody_is_not_lost(recorder):
    """A clock sends the newest alone, and an episode's number is there for who comes late."""
    clock = Topic('/clock', 'rosgraph_msgs/msg/Clock', to_yaml(reliability='best_effort'))
    for number in (1, 5):
        recorder.record(clock, b'\0\1\0\0' + bytes(8), number=number)
        recorder.record(EPISODE, uint32(number), number=number)
        recorder.record(STATES, state(number * PERIOD), number=number)
    assert recorder.lost == 3
