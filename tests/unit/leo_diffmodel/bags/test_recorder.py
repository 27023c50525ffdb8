# SPDX-License-Identifier: Apache-2.0
"""The recorder loses next to nothing to kill -9, and never overwrites a bag."""

import gc
import os
from pathlib import Path
import signal
import subprocess
import sys

from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import ChunkIndex, Message
from mcap.stream_reader import StreamReader
import numpy as np
import pytest
from tests.simulate import PENDULUM

from leo_diffmodel.bags.finish import BagState, finish_bag, finish_left_over, is_recording
from leo_diffmodel.bags.info import bag_info
from leo_diffmodel.bags.recorder import Recorder
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.types import EPISODE, STATES, Topic
from leo_diffmodel.bags.writer import BagWriter
from leo_msgs_py.bag_contents import load
from leo_msgs_py.cdr import joint_state, uint32
from leo_msgs_py.errors import UserError
from leo_msgs_py.mcap_file import find_files, McapFile

CHILD = """
import sys, time
from pathlib import Path
from leo_diffmodel.bags.recorder import Recorder
from leo_diffmodel.bags.types import STATES
from leo_msgs_py.cdr import joint_state

recorder = Recorder(Path(sys.argv[1]))
for k in range(10_000):
    recorder.record(STATES, joint_state(k * 5_000_000, ['pivot'], [0.1 * k], [20.0]))
    print(k, flush=True)
    time.sleep(0.005)
"""


def state(stamp_ns: int, q: float = 0.0) -> bytes:
    return joint_state(stamp_ns, ['pivot'], [q], [0.0])


def streamed_messages(file: Path) -> int:
    """How many messages mcap's own streaming reader gets out of a file without an end."""
    count = 0
    with file.open('rb') as stream:
        records = StreamReader(stream).records
        while True:
            try:
                count += isinstance(next(records), Message)
            except EndOfFile:
                return count


def test_kill_9_costs_at_most_0_2_s_and_the_bag_reads_and_finishes(tmp_path):
    bag = tmp_path / 'bag'
    words = [sys.executable, '-c', CHILD, str(bag)]
    child = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    while int(child.stdout.readline()) < 150:
        pass
    assert is_recording(find_files(bag)[0]) and finish_bag(bag) is BagState.RECORDING
    assert 'still being recorded' in read_bag(bag, PENDULUM).warnings[0]
    os.kill(child.pid, signal.SIGKILL)
    recorded = 151 + len(child.stdout.read().splitlines())
    child.wait()
    streamed = streamed_messages(find_files(bag)[0])
    assert streamed == len(load(bag).topics['/joint_states'].messages)
    recording = read_bag(bag, PENDULUM)
    assert 'cut short' in recording.warnings[0]
    assert recorded - streamed < 0.2 / 0.005  # a row takes the child 5 ms or more
    info = bag_info(bag)
    assert info.state == 'repaired' and bag_info(bag).state == 'finished'
    assert (bag / 'metadata.yaml').is_file()
    finished = read_bag(bag, PENDULUM)
    assert finished.warnings == ()
    assert np.array_equal(finished.episodes[0].q, recording.episodes[0].q)


def test_a_killed_finisher_leaves_the_bag_as_it_was(tmp_path, unfinished):
    dead = tmp_path / 'dead'
    dead.mkdir()
    (dead / 'dead_0.mcap').write_bytes(unfinished)
    (dead / '.dead_0.mcap.finishing').write_bytes(unfinished[:50])
    assert len(load(dead).topics['/joint_states'].messages) == 10
    assert finish_bag(dead) is BagState.REPAIRED
    assert len(load(dead).topics['/joint_states'].messages) == 10


def test_a_restarted_robot_gets_the_next_bag_with_what_was_latched(tmp_path, recorder):
    recorder.describe({'robot': 'pendulum'})
    recorder.record(EPISODE, uint32(3))
    for stamp in [*range(0, 10**9, 10**7), *range(0, 10**9, 10**7)]:
        recorder.record(STATES, state(stamp))
    recorder.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'bag_1']
    for name in ('bag', 'bag_1'):
        contents = load(tmp_path / name)
        assert contents.finished and contents.metadata['leo'] == {'robot': 'pendulum'}
        assert len(contents.topics['/joint_states'].messages) == 100
        assert len(contents.topics['/robot/episode'].messages) == 1
    assert recorder.messages == 201


def test_episodes_begin_where_they_were_published_however_late_they_were_recorded(tmp_path):
    recorder = Recorder(tmp_path / 'bag')
    numbers = [(EPISODE, uint32(k), 1 + 400 * k) for k in range(3)]
    states = [(STATES, state(k * 10**7, 0.001 * k), 10 * k + 5) for k in range(100)]
    for message in [*states, *numbers]:
        recorder.record(*message)
    recorder.close()
    episodes = read_bag(tmp_path / 'bag', PENDULUM).episodes
    assert [len(episode.t) for episode in episodes] == [40, 40, 20]


def test_messages_are_logged_when_they_arrived(tmp_path, recorder):
    recorder.record(EPISODE, uint32(1), 3, 5)
    for logged, stamp in ((7, 10**9), (9, 0)):
        recorder.record(STATES, state(stamp), logged - 1, logged)
    recorder.close()
    logs = [load(tmp_path / name).topics['/robot/episode'] for name in ('bag', 'bag_1')]
    assert [(m.log_ns, m.published_ns) for log in logs for m in log.messages] == [(5, 3), (9, 3)]
    (last,) = load(tmp_path / 'bag_1').topics['/joint_states'].messages
    assert (last.log_ns, last.published_ns) == (9, 8)


def test_what_was_sent_before_a_restart_and_comes_after_it_is_left_out(tmp_path, recorder):
    other = Topic('/others', STATES.type)
    for stamp in range(0, 10**9, 10**7):
        recorder.record(STATES, state(stamp))
        recorder.record(other, state(stamp))
    recorder.record(STATES, state(0))
    recorder.record(other, state(10**9))
    for stamp in (0, 6 * 10**8, 12 * 10**8):
        recorder.record(other, state(stamp))
    recorder.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'bag_1']
    topics = load(tmp_path / 'bag_1').topics
    assert [len(topics[n].messages) for n in ('/joint_states', '/others')] == [1, 3]


def test_two_publishers_a_little_apart_stay_in_one_bag(tmp_path, recorder):
    for k in range(50):
        recorder.record(STATES, state(10**9 + k * 10**7 - (k % 2) * 15 * 10**6))
    recorder.close()
    assert [path.name for path in tmp_path.iterdir()] == ['bag']


def test_an_existing_bag_is_never_overwritten(tmp_path):
    for _ in range(3):
        recorder = Recorder(tmp_path / 'bag')
        recorder.record(STATES, state(0))
        recorder.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'bag_1', 'bag_2']
    with pytest.raises(UserError, match='exists already'):
        BagWriter(tmp_path / 'bag')


def test_the_next_start_finishes_what_was_left_over(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    writer.write(writer.add_topic(STATES.name, STATES.type), state(0), 0)
    writer.flush()
    content = writer.file.read_bytes()
    for name in ('bag_1', 'bag_2', 'other'):
        (tmp_path / name).mkdir()
        (tmp_path / name / f'{name}_0.mcap').write_bytes(content)
    assert finish_left_over(tmp_path / 'bag') == [tmp_path / 'bag_1', tmp_path / 'bag_2']
    assert not load(tmp_path / 'other').finished and not load(tmp_path / 'bag').finished
    writer.close()
    assert load(tmp_path / 'bag').finished


def test_recording_for_long_costs_no_memory_and_every_chunk_is_in_the_index(tmp_path, recorder):
    gc.collect()
    before = sum(isinstance(thing, ChunkIndex) for thing in gc.get_objects())
    for k in range(300):
        recorder.record(STATES, state(k), logged_ns=k + 1)
        recorder.record(EPISODE, uint32(k), logged_ns=k + 1)
        recorder.describe({'robot': f'pendulum {k // 100}'})
        recorder.flush()
    assert sum(isinstance(thing, ChunkIndex) for thing in gc.get_objects()) == before
    recorder.close()
    with find_files(tmp_path / 'bag')[0].open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        part = reader.iter_messages('/joint_states', starting_at=101, ending_before=201)
        read = [message.log_time for _, _, message in part]
    assert len(summary.chunk_indexes) == summary.statistics.chunk_count >= 300
    assert all(len(index.message_index_offsets) == 2 for index in summary.chunk_indexes)
    assert read == [*range(101, 201)]


def test_a_bag_keeps_the_numbers_of_its_messages(tmp_path, recorder):
    for number in (5, 6, 8, 0, 2**32 + 9):
        recorder.record(STATES, state(0), number=number)
    recorder.close()
    (file,) = find_files(tmp_path / 'bag')
    records = McapFile(file).records()
    assert [r.sequence for r in records if isinstance(r, Message)] == [5, 6, 8, 0, 9]


def test_nothing_recorded_leaves_no_folder(tmp_path):
    Recorder(tmp_path / 'bag').close()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('begin', [BagWriter, Recorder])
def test_a_folder_that_cannot_be_made_is_said_before_anything_is_recorded(begin):
    with pytest.raises(UserError, match='cannot make'):
        begin(Path('/proc/no/bag'))
