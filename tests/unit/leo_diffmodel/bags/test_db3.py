# SPDX-License-Identifier: Apache-2.0
"""rosbag2's SQLite bags read as MCAP ones do, around what is damaged."""

from pathlib import Path
import sqlite3

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from tests.damage import one_line
from tests.simulate import PENDULUM

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.cut import cut_bag
from leo_diffmodel.bags.info import bag_info
from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py.bag_contents import load
from leo_msgs_py.cdr import typestore
from leo_msgs_py.errors import UserError


def write_database(folder: Path, bag: Path) -> Path:
    """The topics of one of our bags as rosbags writes them into SQLite."""
    with Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        for topic in load(bag).topics.values():
            connection = writer.add_connection(topic.name, topic.type, typestore=typestore())
            for message in topic.messages:
                writer.write(connection, message.log_ns, message.data)
    return folder


@pytest.fixture(scope='module')
def bags(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp('bags')
    t = 0.01 * np.arange(200)
    inputs = {'pivot': {'voltage': np.cos(3 * t), 'enabled': np.ones(200)}}
    run = Run(t, ['pivot'], np.sin(t)[:, None], np.cos(t)[:, None], inputs=inputs)
    mcap = write_runs(folder / 'mcap', [run, run], {})
    return mcap, write_database(folder / 'sqlite', mcap)


def test_it_reads_as_the_same_bag(bags):
    mcap, sqlite = (read_bag(bag, PENDULUM) for bag in bags)
    file = read_bag(next(bags[1].glob('*.db3')), PENDULUM)
    assert sqlite.warnings == () and file.sha256 == sqlite.sha256
    for a, b, c in zip(mcap.episodes, sqlite.episodes, file.episodes, strict=True):
        for name in ('t', 'q', 'dq', 'inputs', 'enabled'):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
            np.testing.assert_array_equal(getattr(a, name), getattr(c, name))


def test_info_cut_and_play_know_it(bags, tmp_path):
    info = bag_info(bags[1])
    assert (info.state, info.messages, len(info.episodes)) == ('finished', 802, 2)
    cut_bag(bags[1], tmp_path / 'cut', 0.5, 1.5)  # which makes it one with MCAP
    assert list((tmp_path / 'cut').glob('*.mcap'))
    assert len(read_bag(tmp_path / 'cut', PENDULUM).episodes[0].t) == 101


def copied(bags: tuple[Path, Path], folder: Path, change: str = '') -> Path:
    file = folder / 'bag_0.db3'
    file.write_bytes(next(bags[1].glob('*.db3')).read_bytes())
    with sqlite3.connect(file) as database:
        database.execute(change)
    return file


@pytest.mark.parametrize(
    'change',
    [
        "UPDATE messages SET data = 'text' WHERE id = 9",
        'UPDATE messages SET timestamp = -1 WHERE id = 9',
        'UPDATE messages SET timestamp = 1e300 WHERE id = 9',
        "UPDATE messages SET timestamp = 'now', data = x'00' WHERE id = 9",
    ],
)
def test_a_row_that_is_no_message_is_left_out_and_said(bags, tmp_path, change):
    file = copied(bags, tmp_path, change)
    (warning,) = [w for w in read_bag(file, PENDULUM).warnings if 'damaged' in w]
    assert 'damaged in 1 places' in warning


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        ('DROP TABLE topics', 'no rosbag2 SQLite file, or damaged: no such table: topics'),
        ('DROP TABLE messages', 'no such table: messages'),
        ('DELETE FROM messages', 'is empty: nothing was recorded'),
        ("UPDATE topics SET serialization_format = 'json'", 'is empty'),
        ("UPDATE topics SET name = '/arm'", 'has no topic /joint_states; it has /arm'),
    ],
)
def test_what_is_no_bag_is_said_in_one_line(bags, tmp_path, change, message):
    with pytest.raises(UserError, match=message):
        read_bag(copied(bags, tmp_path, change), PENDULUM)


@pytest.mark.parametrize('share', [0.3, 0.6, 0.95])
def test_a_cut_file_is_read_up_to_the_cut(bags, tmp_path, share):
    file = copied(bags, tmp_path)
    with file.open('r+b') as stream:
        stream.truncate(int(share * file.stat().st_size))
    whole, cut = read_bag(bags[1], PENDULUM), read_bag(file, PENDULUM)
    assert any('damaged in 1 places' in warning for warning in cut.warnings)
    states = [sum(len(e.t) for e in recording.episodes) for recording in (cut, whole)]
    assert share - 0.25 < states[0] / states[1] <= 1  # the index is at the end


def test_a_file_of_something_else(tmp_path):
    for content in (b'', b'no database at all, just text that goes on'):
        (tmp_path / 'x.db3').write_bytes(content)
        with pytest.raises(UserError, match='no rosbag2 SQLite file, or damaged'):
            read_bag(tmp_path, PENDULUM)


@settings(max_examples=60, deadline=None)
@given(place=st.floats(0, 1), new=st.binary(min_size=1, max_size=40), cut=st.booleans())
def test_damage_costs_what_it_hits(bags, tmp_path_factory, place, new, cut):
    file = copied(bags, tmp_path_factory.mktemp('damaged'))
    whole = file.read_bytes()
    at = int(place * len(whole))
    file.write_bytes(whole[:at] + (b'' if cut else new + whole[at + len(new) :]))
    one_line(lambda: read_bag(file, PENDULUM))
