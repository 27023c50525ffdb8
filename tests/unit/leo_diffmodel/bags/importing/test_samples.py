# SPDX-License-Identifier: Apache-2.0
"""An import says which rows it leaves out, and leaves nothing where it does not end well."""

from contextlib import suppress
import json
from pathlib import Path

import numpy as np
import pytest

from leo_diffmodel.bags.importing.convert import import_logs, undone_on_error
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.verbs import import_logs as verb
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

pytestmark = pytest.mark.filterwarnings('error')
MAP = """
columns: {half: 1 / q}
time: t
joints: {pivot: {position: q, velocity: dq}}
inputs: {pivot: {voltage: u, enabled: 'on', supply_voltage: half}}
"""
HEAD = 't,q,dq,u,on\n'
GAPS = HEAD + '0,1,0,1,1\n,1,0,1,1\n1,inf,0,1,1\n1,1,0,1,1\n2,1,nan,1,1\n3,1,0,1,1\n4,2,0,1,1\n'
WHOLE = HEAD + '0,0,,,0\n1,1,,,0\n2,inf,,,0\n3,2,,,0\n'


def written(folder: Path, **logs: str) -> list[str]:
    (folder / 'map.yaml').write_text(MAP)
    for name, text in logs.items():
        (folder / f'{name}.csv').write_text(text)
    return [str(folder / f'{name}.csv') for name in logs]


def test_a_line_for_each_log_says_which_rows_are_left_out(tmp_path, capsys):
    logs = written(tmp_path, gaps=GAPS, good=WHOLE.replace('2,inf,,,0\n', ''))
    words = [*logs, '--map', str(tmp_path / 'map.yaml'), '-o']
    assert verb.main([*words, str(tmp_path / 'bag')]) == 0
    left = (
        f'{logs[0]}: 4 of 7 rows left out: 1 without a time, 1 with the time of the row before, '
        '2 without a number for q or dq'
    )
    assert [line for line in capsys.readouterr().out.splitlines() if 'left out' in line] == [left]
    assert verb.main([*words, str(tmp_path / 'other'), '--json']) == 0
    assert json.loads(capsys.readouterr().out)['bags'][0]['left_out'] == [left]


def test_an_infinite_number_is_none_and_a_motor_that_is_off_needs_no_input(tmp_path):
    (log,) = written(tmp_path, off=WHOLE + '4,1e308,,,0\n')
    bag = import_logs([log], tmp_path / 'map.yaml', tmp_path / 'bag')
    recording = read_bag(bag, load_robot('pendulum'))
    assert recording.episodes[0].q[:, 0].tolist() == [0.0, 1.0, 2.0]
    assert not recording.episodes[0].enabled.any()
    assert np.abs(recording.episodes[0].q).max() == 2.0


def test_a_column_of_the_motor_that_drives_nothing_may_hold_no_number(tmp_path):
    (log,) = written(tmp_path, driven=HEAD + '0,0,,1,1\n1,1,,1,1\n2,2,,1,1\n')
    (tmp_path / 'map.yaml').write_text(MAP.replace('supply_voltage: half', 'supply_voltage: dq'))
    bag = import_logs([log], tmp_path / 'map.yaml', tmp_path / 'bag')
    assert read_bag(bag, load_robot('pendulum')).input == 'voltage'


GOOD, BAD = 't,q\n0,1\n1,2\n', 't,q\n0,1\n1,x\n'


@pytest.fixture
def words(tmp_path, monkeypatch) -> list[str]:
    monkeypatch.chdir(tmp_path)
    for name, text in (
        ('good.csv', GOOD),
        ('bad.csv', BAD),
        ('map.yaml', 'time: t\njoints: {pivot: {position: q}}\n'),
    ):
        Path(name).write_text(text)
    return ['good.csv', 'bad.csv', '--map', 'map.yaml', '--bag-per-log', '-o']


def test_after_an_error_in_the_second_log_the_first_can_be_imported_again(words):
    for _ in range(2):
        with pytest.raises(UserError, match='is not a number'):
            verb.main([*words, 'new/bags'])
        assert not Path('new').exists()


def test_what_was_there_before_stays(words):
    Path('bags/other').mkdir(parents=True)
    with pytest.raises(UserError, match='is not a number'):
        verb.main([*words, 'bags'])
    assert [path.name for path in Path('bags').iterdir()] == ['other']
    Path('bags/good').mkdir()
    with pytest.raises(UserError, match='exists already'):
        verb.main([*words, 'bags'])
    with pytest.raises(UserError, match='exists already'):
        verb.main(['good.csv', '--map', 'map.yaml', '-o', 'bags/other'])
    assert sorted(path.name for path in Path('bags').iterdir()) == ['good', 'other']


def test_ctrl_c_after_a_bag_is_written_takes_it_away(words, monkeypatch):
    def interrupted(bag):
        assert bag.exists()
        raise KeyboardInterrupt

    monkeypatch.setattr('leo_diffmodel.bags.info.bag_info', interrupted)
    with pytest.raises(KeyboardInterrupt):
        verb.main(['good.csv', '--map', 'map.yaml', '-o', 'bag'])
    assert not Path('bag').exists()


def test_a_folder_into_which_others_have_written_stays(tmp_path):
    mine, theirs = tmp_path / 'bags/mine', tmp_path / 'bags/theirs'
    with suppress(KeyboardInterrupt), undone_on_error(tmp_path / 'bags') as made:
        mine.mkdir(parents=True)
        theirs.mkdir()
        made.append(mine)
        raise KeyboardInterrupt
    assert [path.name for path in (tmp_path / 'bags').iterdir()] == ['theirs']
