# SPDX-License-Identifier: Apache-2.0
"""leo explain --write-effect, and leo add of what it wrote."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.hostile_names import check_html, folder_of, HTML, RUNS
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.verbs import add, compare, explain
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import get_effect, place

JOINT = f'pivot{RUNS}{HTML}'


@pytest.fixture(scope='module')
def rhythm(tmp_path_factory) -> Path:
    """Two bags of a robot with a torque periodic in time, and what explain made of the first."""
    folder = tmp_path_factory.mktemp('rhythm')
    push = 0.3 * np.sin(2 * np.pi * 1.3 * 0.01 * np.arange(1500))[:, None]
    robot = load_robot(folder_of(folder / 'robot', JOINT))
    for seed, name in ((1, 'one'), (2, 'two')):
        bag(folder / name, record(robot, seconds=15, seed=seed, push=push))
    words = [str(folder / 'one'), '--model', str(robot.folder), '-o', str(folder / 'out')]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert explain.main([*words, '--write-effect', str(folder / 'found.py'), '--json']) == 1
    return folder


def error(model: str, bag: Path, capsys) -> float:
    capsys.readouterr()
    compare.main([str(bag), '--model', model, '--json'])
    rows = json.loads(capsys.readouterr().out)['horizon']
    return next(r['rmse'][0] for r in rows if r['steps'] == 50)


def test_the_name_of_a_joint_never_runs(rhythm, monkeypatch):
    monkeypatch.chdir(rhythm)
    assert get_effect(str(rhythm / 'found.py')).looks_like.startswith(f'A torque at {JOINT} ')
    assert not (rhythm / 'ran').exists()


def test_the_name_of_a_joint_is_no_html_in_the_report(rhythm):
    check_html((rhythm / 'out' / 'report.html').read_text())


def test_explain_json_says_what_is_unknown(rhythm):
    told = json.loads((rhythm / 'out' / 'explain.json').read_text())
    assert told['verdict'] == 'unknown' and told['effects'] == []
    assert told['unknown']['joint'] == JOINT and told['unknown']['variable'] == 'time'
    assert told['unknown']['r2_held_out'] > 0.9
    assert told['unknown']['error_after'] < 0.3 * told['unknown']['error_before']
    assert 'What no known effect explains' in (rhythm / 'out' / 'report.html').read_text()


@pytest.mark.parametrize(
    'words',
    [['--from', 'out/explain.json', '--effect', 'found.py'], [f'found.py:{JOINT}', 'a=0.3']],
    ids=['from explain.json', 'by hand, with its amplitude alone'],
)
def test_added_it_lowers_the_error_on_another_bag(words, rhythm, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(rhythm)
    target = str(tmp_path / 'new.yaml')
    assert add.main(['robot', *words, '-o', target]) == 0
    before = error('robot', rhythm / 'two', capsys)
    assert error(target, rhythm / 'two', capsys) < 0.4 * before


def test_the_effect_file_says_what_it_is(rhythm):
    effect = get_effect(str(rhythm / 'found.py'))
    assert effect.name == 'found_time_torque' and effect.timed
    assert [p.unit for p in effect.parameters] == ['N m', 'Hz', 'rad']


def test_nothing_is_overwritten(rhythm):
    words = [str(rhythm / 'one'), '--model', str(rhythm / 'robot'), '--write-effect']
    with pytest.raises(UserError, match='always written to a new file'):
        explain.main([*words, str(rhythm / 'found.py')])
    with pytest.raises(UserError, match=r'ends in \.py'):
        explain.main([*words, str(rhythm / 'found.txt')])


def test_a_known_effect_makes_no_file(tmp_path, capsys):
    friction = place(TORQUE, 'coulomb_friction', 'pivot', c=0.15)
    bag(tmp_path / 'bag', record(TORQUE, friction, seconds=12))
    target = tmp_path / 'found.py'
    words = [str(tmp_path / 'bag'), '--model', 'torque_pendulum', '--write-effect', str(target)]
    assert explain.main(words) == 0
    assert not target.exists() and 'no effect file' in capsys.readouterr().out
