# SPDX-License-Identifier: Apache-2.0
"""`leo import --guess --model ROBOT` takes joints, units and the input from the robot."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.importing.guess_columns import known_robot, KnownRobot, matched
from leo_diffmodel.bags.importing.guess_constants import constant_lines
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.verbs.import_logs import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.verbs.robot import main as robot_main

T = np.arange(0, 4, 0.01)
ANGLE, VOLTS = 40 * np.sin(T), 6 * np.cos(T)  # rad: six turns
BENCH = """<robot name="bench"><link name="frame"/><link name="wheel"><inertial><mass value="0.5"/>
<inertia ixx="2e-4" iyy="4e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shaft" type="{kind}"><parent link="frame"/><child link="wheel"/><axis xyz="0 1 0"/>
<limit effort="0.16" velocity="300" lower="-1" upper="1"/></joint></robot>"""


def bench(folder: Path, kind: str = 'continuous', takes: str = 'torque') -> Path:
    folder.mkdir(exist_ok=True)
    (folder / 'bench.urdf').write_text(BENCH.format(kind=kind))
    robot_main(['init', str(folder / 'bench.urdf'), '-o', str(folder / 'bench'), '--input', takes])
    return folder / 'bench'


def log_of(
    file: Path, head: str, *columns: np.ndarray, sep: str = ',', code: str = 'utf-8'
) -> Path:
    rows = [sep.join(f'{v:.6f}' for v in row) for row in zip(*columns, strict=True)]
    text = '\n'.join([head, *rows])
    file.write_bytes((text.replace('.', ',') if sep == ';' else text).encode(code))
    return file


def said(log: Path, robot: str) -> dict:
    file = guess_map(log, log.with_suffix('.yaml'), load_robot(robot), robot)
    return yaml.safe_load(file.read_text())


@pytest.mark.parametrize('code', ['utf-8', 'cp1252', 'utf-16'])
def test_a_bench_log_in_any_encoding_becomes_the_same_bag(tmp_path, code, capsys):
    robot = bench(tmp_path)
    head = 'Zeit [s];Spannung [V];Winkel [°];Drehzahl [U/min]'
    columns = T, VOLTS, np.degrees(ANGLE), 40 * np.cos(T) * 30 / np.pi
    log = log_of(tmp_path / 'log.csv', head, *columns, sep=';', code=code)
    column_map, bag = tmp_path / 'map.yaml', tmp_path / 'bag'
    assert main([str(log), '--guess', '--model', str(robot), '-o', str(column_map)]) == 0
    assert main([str(log), '--map', str(column_map), '-o', str(bag)]) == 0
    assert f'--model {robot}' in capsys.readouterr().out
    (episode,) = read_bag(bag, load_robot(bench(tmp_path / 'v', takes='voltage'))).episodes
    np.testing.assert_allclose(episode.q[:, 0], ANGLE, atol=1e-6)
    np.testing.assert_allclose(episode.dq[:, 0], 40 * np.cos(T), atol=1e-6)
    np.testing.assert_allclose(episode.inputs[:, 0], VOLTS, atol=1e-6)
    assert 'takes torque, the log has voltage: make the robot with' in column_map.read_text()


@pytest.mark.parametrize(
    ('head', 'scale', 'unit'),
    [
        *(('t,q,rate [rpm]', 1.0, 'rad'), ('t,q,rate [rpm]', 180 / np.pi, 'deg')),
        *(('t,q,other', 1.0, '?'), ('t,q,other', 180 / np.pi, '?')),
    ],
)
def test_a_joint_that_turns_round_is_in_the_unit_of_its_speed(tmp_path, head, scale, unit):
    log = log_of(tmp_path / 'log.csv', head, T, scale * ANGLE, 40 * np.cos(T) * 30 / np.pi)
    assert said(log, str(bench(tmp_path)))['joints']['shaft']['position']['unit'] == unit


def test_a_slide_is_in_metres_and_newtons_even_where_nothing_says_so(tmp_path):
    log = log_of(tmp_path / 'log.csv', 't,pos,vel,force', T, np.sin(T), np.cos(T), T)
    joint = said(log, str(bench(tmp_path, 'prismatic')))['joints']['shaft']
    found = {name: spec['unit'] for name, spec in joint.items()}
    assert found == {'position': 'm', 'velocity': 'm/s', 'effort': 'N'}


@pytest.mark.parametrize(('reach', 'unit'), [(1, 'rad'), (60, 'deg'), (95, 'deg'), (4000, '?')])
def test_the_stops_say_the_unit_of_an_angle(tmp_path, reach, unit):
    t = np.arange(0, 6.3, 0.1)
    log = log_of(tmp_path / 'log.csv', 't,elbow_flex_pos', t, reach * np.sin(t))
    assert said(log, 'so101')['joints']['elbow_flex']['position']['unit'] == unit


@pytest.mark.parametrize(
    ('takes', 'column'), [('voltage', 'voltage'), ('torque', 'tau'), ('position', 'q_goal')]
)
def test_the_input_that_the_robot_takes_comes_first(tmp_path, takes, column):
    log = log_of(tmp_path / 'log.csv', 't,q,tau,voltage,q_goal', T, np.sin(T), T, T, np.sin(T))
    (spec,) = said(log, str(bench(tmp_path, takes=takes)))['inputs']['shaft'].values()
    assert spec['column'] == column


@pytest.mark.parametrize(
    ('takes', 'interface', 'unit', 'why'),
    [
        ('torque', 'effort', '?', 'takes torque, and the name does not say what it is: unit: N m'),
        ('voltage', 'voltage', '?', 'takes voltage, and the name does not say what it is: unit:'),
        ('position', 'position', 'rad', 'within the stops'),
    ],
)
def test_a_command_of_nothing_is_the_input_that_the_robot_takes(
    tmp_path, takes, interface, unit, why
):
    log = log_of(tmp_path / 'log.csv', 't,pos,vel,cmd', T, np.sin(T), np.cos(T), np.cos(T))
    robot = str(bench(tmp_path, 'revolute', takes))
    assert said(log, robot)['inputs'] == {'shaft': {interface: {'column': 'cmd', 'unit': unit}}}
    text = log.with_suffix('.yaml').read_text()
    assert why in text and 'make the robot' not in text


@pytest.mark.parametrize('head', ['t,q,tau,cmd', 't,q,cmd,tau_cmd', 't,q,x,cmd [Nm]'])
def test_a_name_that_says_the_input_comes_before_the_robot(tmp_path, head):
    log = log_of(tmp_path / 'log.csv', head, T, np.sin(T), T, T)
    (spec,) = said(log, str(bench(tmp_path)))['inputs']['shaft'].values()
    assert spec['column'] == next(n for n in head.split(',') if 'tau' in n or 'Nm' in n)
    assert spec['unit'] == 'N m'


@pytest.mark.parametrize('of', [1.0, 1000.0])
def test_constants_of_a_head_are_in_the_unit_that_is_near(tmp_path, of):
    head = 't,q,goal,mass,length,kp,vin'
    ones = [value + 0 * T for value in (0.6 * of, 0.12 * of, 400, 7 * of)]
    log = log_of(tmp_path / 'log.csv', head, T, np.sin(T), np.sin(T), *ones)
    file = guess_map(log, tmp_path / 'a.yaml', load_robot('xl330_pendulum'), 'xl330_pendulum')
    bag = read_bag(import_logs([log], file, tmp_path / 'bag'), load_robot('xl330_pendulum'))
    weight = {'links.weight.mass': 0.6, 'links.weight.com_z': -0.12}
    motor = {'actuators.pivot.position_gain': 1.150952, 'actuators.pivot.supply': 7.0}
    assert bag.constants == pytest.approx(weight | motor)
    text = guess_map(log, tmp_path / 'b.yaml').read_text()
    assert 'constants: {?: {column: mass, unit: kg}}' in text and 'links.LINK.mass' in text


def test_a_constant_is_told_once_and_in_its_own_dimension():
    robot, table = load_robot('xl330_pendulum'), {n: np.full(3, 0.6) for n in ('mass', 'payload')}
    known = known_robot(robot, 'arm')
    found = [(path, why) for path, _, why in constant_lines(table, known)]
    assert found == [('links.weight.mass', '0.6'), ('', '0.6: links.weight.mass')]
    lift = replace(known.constants['links.weight.mass'], path='actuators.lift.stiffness')
    known = known._replace(constants={lift.path: replace(lift, unit='N/m')})
    assert [path for path, _, _ in constant_lines({'kp': np.full(3, 0.6)}, known)] == ['']


ARM = KnownRobot('arm', ('shoulder_pan', 'shoulder_lift', 'elbow'), frozenset(), {}, 'voltage')
LEGS = KnownRobot('legs', ('left_hip', 'right_hip'), frozenset(), {}, 'voltage')
NUMBERED = KnownRobot('numbered', ('j1', 'j2', 'j3'), frozenset(), {}, 'torque')


@pytest.mark.parametrize(
    ('names', 'robot', 'found'),
    [
        (['ShoulderLift', 'elbow_joint'], ARM, ['shoulder_lift', 'elbow']),
        (['shoulder pan', 'elbow_joint'], ARM, ['shoulder_pan', 'elbow']),
        (['joint3', 'joint1', 'joint2'], ARM, ['elbow', 'shoulder_pan', 'shoulder_lift']),
        (['shoulder_pan', 'shoulder_lift', 'j5'], ARM, ['shoulder_pan', 'shoulder_lift', 'elbow']),
        (['hip_right'], LEGS, ['right_hip']),
        (['elbow'], ARM, ['elbow']),
        (['joint3', 'joint1'], NUMBERED, ['j3', 'j1']),
    ],
)
def test_joints_by_their_names_or_their_order(names, robot, found):
    assert [matched(names, robot)[name][0] for name in names] == found


def test_names_that_are_no_joints_of_the_robot(tmp_path):
    log = log_of(tmp_path / 'log.csv', 't,left_pos,right_pos', T, T, T)
    with pytest.raises(UserError, match='none of left, right in the log is named like a joint of'):
        said(log, 'so101')


def test_how_names_became_joints_is_told(tmp_path):
    log = log_of(tmp_path / 'log.csv', 't,q1,q2,tau1,tau2', T, T, T, T, T)
    file = guess_map(log, tmp_path / 'map.yaml', load_robot('double_pendulum'), 'double_pendulum')
    told = "joint1 in the log is shoulder of double_pendulum: in the robot's order"
    assert told in file.read_text()
    bag = import_logs([log], file, tmp_path / 'bag')
    assert read_bag(bag, load_robot('double_pendulum')).episodes[0].q.shape == (len(T), 2)


def test_a_model_goes_with_a_guess(tmp_path):
    with pytest.raises(UserError, match='--model goes with --guess'):
        main(['log.csv', '--map', 'map.yaml', '--model', 'pendulum', '-o', 'bag'])
