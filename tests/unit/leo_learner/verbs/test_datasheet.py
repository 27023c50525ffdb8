# SPDX-License-Identifier: Apache-2.0
"""`leo datasheet`: the motion as a file, sheets side by side, and what it refuses."""

import json
from pathlib import Path

import pytest
from tests.places import DATA

from leo_diffmodel.next_run.run_file import read_run
from leo_learner.verbs.datasheet import main
from leo_learner.verbs.play import main as play
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.verbs.skeleton.folder import make_folder

RESISTANCE = {'value': 2.5, 'unit': 'ohm', 'ci95': [2.4, 2.6]}
SHEET = {
    'robot': 'bench',
    'joint': 'pivot',
    'constants': {'actuators.pivot.resistance': RESISTANCE},
    'friction': {'law': 'none', 'rivals': [], 'effects': []},
    'ladder': [{'law': 'none', 'verdict': 'chosen', 'error': {'rad': 0.01, 'rad/s': 0.1}}],
    'others': [],
    'error': {'figure': 'held-out error 0.5 s ahead'},
}


def written(path, **changed):
    path.parent.mkdir()
    path.write_text(json.dumps(SHEET | changed))
    return str(path)


def test_the_motion_is_a_run_file_of_the_robot(tmp_path, capsys):
    file = tmp_path / 'elbow.csv'
    assert main(['--robot', 'so101', '--joint', 'elbow_flex', '--motion', str(file)]) == 0
    assert read_run(file).run_for(load_robot('so101')).count > 3000
    assert f'next: leo play {file} --bag' in capsys.readouterr().out


def test_the_motion_of_a_robot_of_ones_own_is_played_by_what_is_printed(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    make_folder(DATA / 'arm2.urdf', tmp_path / 'own', 'torque')
    assert main(['--model', 'own', '--joint', 'joint2', '--motion', 'a.csv']) == 0
    assert 'next: leo play a.csv --predict own --bag bags/unit1' in capsys.readouterr().out
    with pytest.raises(UserError, match=r"a\.csv: no .*'arm2'.*name its model with --predict"):
        play(['a.csv', '--yes'])
    rows = Path('a.csv').read_text().splitlines(keepends=True)
    Path('a.csv').write_text(''.join(rows[:100]))
    assert play(['a.csv', '--model', 'own']) == 0


def test_sheets_of_two_units_side_by_side(tmp_path, capsys):
    one = written(tmp_path / 'unit1' / 'datasheet.json')
    other = written(tmp_path / 'unit2' / 'datasheet.json', constants={})
    assert main([one, other]) == 0
    out = capsys.readouterr().out
    assert 'unit1' in out
    assert 'unit2' in out
    (line,) = (line for line in out.splitlines() if 'resistance' in line)
    assert '2.50 ± 0.10' in line
    assert '–' in line


NO_LADDER = json.dumps(SHEET | {'ladder': []})
NO_VALUES = json.dumps(SHEET | {'constants': {'a': 3}})


@pytest.mark.parametrize('text', ['[]', '{', '{"constants": {}}', NO_LADDER, NO_VALUES])
def test_another_file_is_no_sheet(tmp_path, text):
    path = tmp_path / 'a.json'
    path.write_text(text)
    with pytest.raises(UserError, match=r'a\.json'):
        main([str(path)])


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (['--model', 'so101', '--motion', 'a.csv'], '--joint: shoulder_pan, shoulder_lift'),
        (['bags/unit1'], '--model'),
        (['--model', 'servo_pendulum'], '-o DIR'),
        (['--model', 'servo_pendulum', '-o', '.'], 'exists'),
    ],
)
def test_what_is_missing_or_in_the_way_is_said(tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'bag').mkdir()
    with pytest.raises(UserError, match=said):
        main(words)
