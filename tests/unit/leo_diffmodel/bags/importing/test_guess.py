# SPDX-License-Identifier: Apache-2.0
"""A guessed column map says why, imports where all is said, and is refused where it is not."""

import json
from pathlib import Path
import re

import numpy as np
import pytest
from tests.lerobot_data import write_lerobot
import yaml

from leo_diffmodel.bags.importing.convert import import_logs, load_map
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.importing.guess_roles import role_of, roles_of
from leo_diffmodel.bags.importing.guess_units import of_angles, of_time
from leo_diffmodel.verbs.import_logs import main
from leo_msgs_py import units
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

NAMES = """
position, shoulder_pan, -: observation.state.shoulder_pan.pos
position!, shoulder_pan, -: action.shoulder_pan.pos ;; position!, joint0, -: action.0 | actions.0
position, joint1, -: pos1 | jointPos1 | j1 angle | Achse 1 Winkel | observations.qpos[1]
velocity, joint1, -: dq1 | theta1_dot ;; position, elbow, deg: Elbow angle [deg]
velocity, elbow, rad/s: elbow_speed (rad/s) | elbow_rad_s ;; effort!, -, -: tau_cmd
time, -, ms: time_ms ;; velocity!, -, -: goal_velocity ;; -, frame_index, -: frame_index
position, -, deg: Winkel [°] | angle (deg)
velocity, -, rpm: Drehzahl [U/min] | vitesse [tr/min] ;; time, -, s: Zeit [s] | Temps (s)
voltage, -, V: Spannung [V] | U [V]
position!, -, deg: Sollwinkel [Grad] | Consigne position (°) ;; position, -, -: Istwinkel
velocity, motor, rpm: Motordrehzahl [1/min]
effort, -, N m: Drehmoment (N·m) | Couple mesuré [N.m] | tau_Nm ;; current, -, A: Strom [A]
supply_voltage, -, V: Versorgungsspannung [V] ;; velocity, -, -: vitesse ;; effort, -, -: couple
position, -, m: x_m ;; velocity, -, m/s: x_m_s ;; effort, -, N: F_N
position, slide, m: slide_m ;; position, shoulder, deg: shoulder_deg
velocity, wheel, rpm: wheel_rpm ;; effort, m, -: tau_m ;; position, m, -: theta_m
position, s, -: q_s ;; position, raw, -: angle (raw) ;; position, joint0, -: state.0
acceleration, joint1, -: ddq1 ;; effort, joint1, -: axis_1_torque
position!, elbow, -: goal.data.elbow | elbow_pos_wanted ;; error, elbow, -: elbow_pos_error
"""  # quantity (! for a goal), joint, unit: names of such columns


@pytest.mark.parametrize('said', re.split(r'\n| ;; ', NAMES.strip()))
def test_names_in_three_languages_say_what_columns_are(said):
    role, columns = said.split(': ')
    quantity, joint, unit = (word.replace('-', '') for word in role.split(', '))
    for column in columns.split(' | '):
        assert role_of(column) == (quantity.rstrip('!'), quantity.endswith('!'), joint, unit)
    assert role_of('') == ('', False, '', '')


def test_joints_of_topics_are_without_the_names_of_the_topics():
    topics = 'robot1.arm.joint_states.position', 'robot1.arm.joint_states.velocity', 'goal.data'
    names = [f'{topic}.{joint}' for topic in topics for joint in 'ab'] + ['left.tau[1]', 'tau[1]']
    joints = [role.joint for role in roles_of(['log_time', *names]).values()]
    assert joints[1:] == [*'ab' * 3, 'left_1', 'joint1']


@pytest.mark.parametrize(
    ('peak', 'unit'), [(3.1, 'rad'), (95, '?'), (100, '?'), (120, 'deg'), (4095, '?')]
)
def test_numbers_say_the_unit_of_angles_or_leave_it_open(peak, unit):
    assert of_angles([np.array([0.1, -peak, np.nan])]).name == unit


@pytest.mark.parametrize(
    ('step', 'unit'),
    [(0.002, 's'), (0.2, 's'), (5, 'ms'), (33.3, 'ms'), (5000, 'us'), (1e7, 'ns'), (0, '?')],
)
def test_numbers_say_the_unit_of_time(step, unit):
    assert of_time(step * np.arange(9.0)).name == unit


@pytest.mark.parametrize(('low', 'high', 'whole'), [(0, 1, 1), (3, 228, 255), (0, 1000, 1000)])
def test_the_way_of_a_hand_is_no_angle(tmp_path, low, high, whole):
    log, way = tmp_path / 'log.csv', np.linspace(low, high, 200).round(0 if high > 1 else 3)
    rows = np.column_stack([np.arange(200) / 50, np.linspace(-1, 1, 200), way])
    np.savetxt(log, rows, delimiter=',', header='t,elbow_pos,gripper_pos', comments='')
    assert [*guessed(log)['joints']] == ['elbow']
    told = f'# gripper is left out, gripper_pos: 0 to {whole} of the way of a hand: scale: rad or'
    assert told in log.with_suffix('.map.yaml').read_text()
    file = guess_map(log, tmp_path / 'map.yaml', robot := load_robot('so101'), 'so101')
    found = yaml.safe_load(file.read_text())['joints']['gripper']['position']
    stops = next(joint.limits for joint in robot.joints if joint.name == 'gripper')
    assert found['offset'] + found['scale'] * np.r_[0, whole] == pytest.approx(stops, abs=1e-4)


def test_a_hand_with_a_unit_in_its_name_is_a_joint(tmp_path):
    rows = np.column_stack([np.arange(200) / 50, np.linspace(-1, 1, 200), np.linspace(0, 1, 200)])
    np.savetxt(log := tmp_path / 'log.csv', rows, '%g', ',', header='t,elbow_pos,gripper [rad]')
    assert guessed(log)['joints']['gripper']['position']['unit'] == 'rad'


def test_counts_of_servos_are_no_degrees():
    ends = of_angles([np.array([3000.0, 100.0, 7.0])]).entry
    assert ends == {'scale': 0.00153398, 'offset': -3.14159}
    assert [of_angles([np.array([x, 100.0, 7.0])]).name for x in (700, 700.5)] == ['?', 'deg']


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


@pytest.mark.parametrize(
    ('flag', 'off', 'on', 'found'),
    [
        *(('torque_enable', 'false', 'true', 'enabled'), ('motor_on', '0', '0', 'enabled')),
        *(('elbow_enabled', '0', '1', 'enabled'), ('enable_cmd', '0', '1', 'enabled')),
        *(('elbow_torque', '0', '1', 'effort'), ('elbow_torque', '0.2', '1', 'effort')),
    ],
)
def test_a_flag_is_no_torque_and_may_say_when_the_motor_is_on(tmp_path, flag, off, on, found):
    log = tmp_path / 'log.csv'
    log.write_text(f't,elbow_pos,elbow_goal,{flag}\n0,1,1,{off}\n0.1,1.1,1,{on}\n')
    said = guessed(log)
    columns = {**said['joints']['elbow'], **said['inputs']['elbow']}
    assert set(columns) == {'position', found}
    import_logs([log], log.with_suffix('.map.yaml'), tmp_path / 'bag')


def test_a_flag_is_of_its_motor_or_of_all_and_a_joint_may_be_called_active(tmp_path):
    log = tmp_path / 'log.csv'
    head = 't,motor_left_pos,motor_right_pos,motor_left_torque,motor_right_torque,motor_left_on'
    log.write_text(f'{head}\n0,1,1,0.2,0.2,0\n0.1,1,1,0.2,0.2,1\n')
    inputs = guessed(log)['inputs']
    assert [joint for joint, columns in inputs.items() if 'enabled' in columns] == ['motor_left']
    active = tmp_path / 'active.csv'
    active.write_text('t,active_pos,passive_pos,active_torque\n0,1,1,0.2\n0.1,1.1,1,0.3\n')
    said = guessed(active)
    assert set(said['joints']) == {'active', 'passive'} and set(said['inputs']) == {'active'}
    log.write_text('t,q1,q2,tau1,tau2,torque_enable\n0,1,1,0.2,0.2,1\n0.1,1,1,0.2,0.2,0\n')
    file = guess_map(log, tmp_path / 'map.yaml', load_robot('double_pendulum'), 'double_pendulum')
    inputs = yaml.safe_load(file.read_text())['inputs']
    flags = {joint: of['enabled'] for joint, of in inputs.items()}
    assert flags == {'shoulder': 'torque_enable', 'elbow': 'torque_enable'}


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


def test_all_episodes_of_a_lerobot_data_set_say_that_it_is_in_degrees(tmp_path):
    said = guessed(lerobot(tmp_path, 120))
    assert said['joints']['shoulder_pan']['position']['unit'] == 'deg'
    assert said['inputs']['gripper']['position'] == {'column': 'action.gripper.pos', 'unit': '?'}
    still, moved = np.full((40, 2), 1.0), np.full((40, 2), 130.0)
    data = write_lerobot(tmp_path / 'other', [(still, still), (moved, moved)])
    assert guessed(data)['joints']['shoulder_pan']['position']['unit'] == 'deg'


def test_what_may_be_degrees_or_per_cent_is_left_open_and_refused(tmp_path):
    data = lerobot(tmp_path, 90)
    file = guess_map(data, tmp_path / 'map.yaml')
    assert load_map(file).joints['shoulder_pan'].position.unit == '?'
    with pytest.raises(UserError, match=r'shoulder_pan.pos: fill in the unit of position'):
        import_logs([data], file, tmp_path / 'bag')


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('a,b\n1,2\n', "no column is named as a position is; there are 'a', 'b'"),
        ('', 'is empty'),
        ('q\n1\nx\n', 'is not a number'),
        ('q,q\n1,x\n', 'is the name of columns 1 and 2'),
    ],
)
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


@pytest.mark.parametrize(
    ('head', 'per_second'),
    [('t,q,dq', 'rad/s'), ('t,q,dq', 'deg/s'), ('t,q,dq', 'rpm'), ('t,x_m,vel', 'm/s')],
)
def test_a_speed_is_in_the_unit_in_which_it_is_the_change_of_its_position(
    tmp_path, head, per_second
):
    t = np.arange(300) / 100
    speed = np.cos(t) / units.parse(per_second).factor
    rows = np.column_stack([t, np.sin(t), speed])
    np.savetxt(tmp_path / 'log.csv', rows, delimiter=',', header=head, comments='')
    assert guessed(tmp_path / 'log.csv')['joints']['joint']['velocity']['unit'] == per_second


def test_constants_of_comments_and_the_encoding_are_told(tmp_path):
    (tmp_path / 'log.csv').write_bytes('# Länge = 0,3 m\nt,q\n0,1\n0.1,2\n'.encode('cp1252'))
    text = guess_map(tmp_path / 'log.csv', tmp_path / 'map.yaml').read_text()
    assert 'its comments say Länge = 0.3 m' in text and 'read as cp1252' in text


def test_columns_that_have_only_numbers(tmp_path):
    (tmp_path / 'log.json').write_text(json.dumps({'rows': [[0.0, 1.0], [0.1, 2.0]]}))
    with pytest.raises(UserError, match=r'columns have numbers and no names: .* header: \[time'):
        guess_map(tmp_path / 'log.json', tmp_path / 'map.yaml')
