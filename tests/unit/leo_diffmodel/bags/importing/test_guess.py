# SPDX-License-Identifier: Apache-2.0
"""A guessed column map says why, imports where all is said, and is refused where it is not."""

import json
from pathlib import Path
import re

import numpy as np
import pytest
from tests.lerobot_data import write_lerobot
import yaml

from leo_diffmodel.bags.importing import import_logs
from leo_diffmodel.bags.importing.convert import load_map
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.importing.guess_roles import role_of
from leo_diffmodel.bags.importing.guess_units import of_angles, of_time
from leo_diffmodel.verbs.import_logs import main
from leo_msgs_py.errors import UserError


@pytest.mark.parametrize(('column', 'quantity', 'is_goal', 'joint', 'unit'), [
    ('observation.state.shoulder_pan.pos', 'position', False, 'shoulder_pan', ''),
    ('action.shoulder_pan.pos', 'position', True, 'shoulder_pan', ''),
    ('action.0', 'position', True, 'joint0', ''), ('pos1', 'position', False, 'joint1', ''),
    ('dq1', 'velocity', False, 'joint1', ''),
    ('Elbow angle [deg]', 'position', False, 'elbow', 'deg'),
    ('elbow_speed (rad/s)', 'velocity', False, 'elbow', 'rad/s'),
    ('tau_cmd', 'effort', True, '', ''),
    ('time_ms', 'time', False, '', 'ms'), ('goal_velocity', 'velocity', True, '', ''),
    ('frame_index', '', False, 'frame_index', ''), ('', '', False, '', ''),
])  # fmt: skip
def test_names_say_what_columns_are(column, quantity, is_goal, joint, unit):
    assert role_of(column) == (quantity, is_goal, joint, unit)


@pytest.mark.parametrize(('peak', 'unit'), [(3.1, 'rad'), (95, '?'), (100, '?'), (120, 'deg'),
                                            (4095, '?')])  # fmt: skip
def test_numbers_say_the_unit_of_angles_or_leave_it_open(peak, unit):
    assert of_angles([np.array([0.1, -peak, np.nan])]).name == unit


@pytest.mark.parametrize(('step', 'unit'), [(0.002, 's'), (0.2, 's'), (5, 'ms'), (33.3, 'ms'),
                                            (5000, 'us'), (1e7, 'ns'), (0, '?')])  # fmt: skip
def test_numbers_say_the_unit_of_time(step, unit):
    assert of_time(step * np.arange(9.0)).name == unit


def guessed(log: Path) -> dict:
    return yaml.safe_load(guess_map(log, log.with_suffix('.map.yaml')).read_text())


def test_a_csv_log_with_torques_imports_as_guessed(tmp_path):
    log = tmp_path / 'log.csv'
    rows = ''.join(f'{k * 5};{0.01 * k};{0.5};{k % 3};7\n' for k in range(20)).replace('.', ',')
    log.write_text(f'time;pos1;vel1;tau1;note\n{rows}')
    said = guessed(log)
    assert said['time'] == {'column': 'time', 'unit': 'ms'}
    assert said['joints']['joint1']['velocity'] == {'column': 'vel1', 'unit': 'rad/s'}
    assert said['inputs']['joint1'] == {'effort': {'column': 'tau1', 'unit': 'N m'}}
    assert "# not used: 'note'" in log.with_suffix('.map.yaml').read_text()
    import_logs([log], log.with_suffix('.map.yaml'), tmp_path / 'bag')


def test_of_json_the_rows_are_found(tmp_path):
    log = tmp_path / 'log.json'
    rows = [{'timestamp': 0.01 * k, 'angle': 0.1, 'goal_position': 0.2} for k in range(5)]
    log.write_text(json.dumps({'head': {'mass': 0.5}, 'run': {'rows': rows}}))
    said = guessed(log)
    assert said['records'] == 'run.rows'
    assert said['inputs'] == {'joint': {'position': {'column': 'goal_position', 'unit': 'rad'}}}


@pytest.mark.parametrize(('reach', 'unit'), [(1, 'rad/s'), (50, '?'), (170, 'deg/s')])
def test_rates_are_in_the_unit_of_their_angles(tmp_path, reach, unit):
    log = tmp_path / 'log.csv'
    log.write_text(f't,q,dq\n0,{reach},1\n0.1,{-reach},1\n')
    assert guessed(log)['joints']['joint']['velocity']['unit'] == unit


def lerobot(tmp_path: Path, reach: float) -> Path:
    t = np.arange(60) / 30
    state = np.stack([reach * np.sin(t), 50 + 40 * np.sin(t)], axis=1)
    return write_lerobot(tmp_path / 'data', [(state, state)])


def test_a_lerobot_data_set_in_degrees(tmp_path):
    said = guessed(lerobot(tmp_path, 120))
    assert said['joints']['shoulder_pan']['position']['unit'] == 'deg'
    assert said['inputs']['gripper']['position'] == {'column': 'action.gripper.pos', 'unit': '?'}


def test_all_episodes_say_the_unit(tmp_path):
    still, moved = np.full((40, 2), 1.0), np.full((40, 2), 130.0)
    data = write_lerobot(tmp_path / 'data', [(still, still), (moved, moved)])
    assert guessed(data)['joints']['shoulder_pan']['position']['unit'] == 'deg'


def test_what_may_be_degrees_or_per_cent_is_left_open_and_refused(tmp_path):
    data = lerobot(tmp_path, 90)
    file = guess_map(data, tmp_path / 'map.yaml')
    assert load_map(file).joints['shoulder_pan'].position.unit == '?'
    with pytest.raises(UserError, match=r'shoulder_pan.pos: fill in the unit of position'):
        import_logs([data], file, tmp_path / 'bag')


@pytest.mark.parametrize(('text', 'message'), [
    ('a,b\n1,2\n', "no column is named as a position is; there are 'a', 'b'"), ('', 'is empty'),
    ('q\n1\nx\n', 'is not a number'), ('q,q\n1,x\n', 'is the name of columns 1 and 2'),
])  # fmt: skip
def test_what_cannot_be_guessed(tmp_path, text, message):
    (tmp_path / 'log.csv').write_text(text)
    with pytest.raises(UserError, match=re.escape(message)):
        guess_map(tmp_path / 'log.csv', tmp_path / 'map.yaml')
    assert not (tmp_path / 'map.yaml').exists()


def test_without_a_time_there_is_one_to_fill_in(tmp_path):
    (tmp_path / 'log.csv').write_text('q,t\n1,2\n2,1\n')
    file = guess_map(tmp_path / 'log.csv', tmp_path / 'map.yaml')
    with pytest.raises(UserError, match='give either column or period'):
        load_map(file)


def test_the_verb_says_what_it_wrote_and_overwrites_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'my log.csv').write_text('t,q\n0,1\n0.1,2\n')
    assert main(['my log.csv', '--guess']) == 0
    out = capsys.readouterr().out
    assert "next: leo import 'my log.csv' --map 'my log_map.yaml' -o BAG" in out
    with pytest.raises(UserError, match=r'is there already; name another one'):
        main(['my log.csv', '--guess'])
    with pytest.raises(UserError, match=r"begin with: leo import 'my log.csv' --guess"):
        main(['my log.csv', '-o', 'bag'])
    assert main(['my log.csv', '--map', 'my log_map.yaml', '-o', 'bag']) == 0
