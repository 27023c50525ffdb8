# SPDX-License-Identifier: Apache-2.0
"""A bag with more topics than robots have is refused at once, as it was found."""

from pathlib import Path
import sqlite3

from mcap.writer import CompressionType, Writer
import pytest

from leo_diffmodel.bags.info import bag_info
from leo_diffmodel.bags.types import definition, UINT32
from leo_msgs_py.cdr import uint32
from leo_msgs_py.cli import main
from leo_msgs_py.mcap_file import find_files, MOST_TOPICS


def mcap(folder: Path, topics: int, facts: int = 0, finished: bool = True) -> Path:
    """A bag with one message, so many topics, and so many facts about its robot."""
    folder.mkdir()
    with (folder / 'bag_0.mcap').open('wb') as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start('ros2')
        schema = writer.register_schema(UINT32, 'ros2msg', definition(UINT32)[0].encode())
        channels = [writer.register_channel(f'/t{k}', 'cdr', schema) for k in range(topics)]
        writer.add_metadata('leo', {f'fact_{k}': 'x' for k in range(facts)})
        writer.add_message(channels[0], 1, uint32(1), 1)
        writer.finish()
    if not finished:
        (file,) = find_files(folder)
        file.write_bytes(file.read_bytes()[:-20])
    return folder


def sqlite(folder: Path, topics: int) -> Path:
    folder.mkdir()
    with sqlite3.connect(folder / 'bag_0.db3') as database:
        columns = 'id, name, type, serialization_format, offered_qos_profiles'
        database.execute(f'CREATE TABLE topics({columns})')
        database.execute('CREATE TABLE messages(id, topic_id, timestamp, data)')
        rows = ((k, f'/t{k}') for k in range(topics))
        database.executemany("INSERT INTO topics VALUES(?, ?, 'a/msg/B', 'cdr', '')", rows)
    return folder


@pytest.mark.parametrize(
    'made', [mcap, sqlite, lambda folder, topics: mcap(folder, topics, finished=False)]
)
def test_more_topics_than_robots_have_are_one_line(made, tmp_path, capsys):
    bag = made(tmp_path / 'bag', MOST_TOPICS + 1)
    before = {file.name: file.read_bytes() for file in bag.iterdir()}
    assert main(['bag', 'info', str(bag)]) == 2
    out, err = capsys.readouterr()
    assert out == '' and len(err.splitlines()) == 1 and f'more than {MOST_TOPICS} topics' in err
    assert {file.name: file.read_bytes() for file in bag.iterdir()} == before


def test_as_many_topics_as_robots_may_have_are_read(tmp_path):
    assert len(bag_info(mcap(tmp_path / 'bag', MOST_TOPICS)).topics) == MOST_TOPICS


def test_of_many_facts_some_are_shown(tmp_path, capsys):
    assert main(['bag', 'info', str(mcap(tmp_path / 'bag', 1, facts=1000))]) == 0
    assert len(capsys.readouterr().out.splitlines()) < 100
