# SPDX-License-Identifier: Apache-2.0
"""Files in mm, g or degrees are asked about, none of ours; longer steps once rotors are known."""

import json

import pytest
from tests.places import DATA
from tests.robots import skeleton_of, SLIDES

from leo_msgs_py.cli import main
from leo_sim.description.robot import load_robot, named_robots
from leo_sim.verbs.skeleton.figures import doubt, gravity_torque
from leo_sim.verbs.skeleton.folder import make_folder

LINK = """<robot name="r"><link name="base"/><link name="l1"><inertial>
<origin xyz="0 0 {com}"/><mass value="{mass}"/><inertia ixx="{moment}" ixy="0" ixz="0"
iyy="{moment}" iyz="0" izz="{moment}"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
<limit lower="{low}" upper="{high}" effort="1" velocity="1"/></joint></robot>"""
PLAIN = {'com': -0.1, 'mass': 0.5, 'moment': 5e-4, 'low': -1.5, 'high': 1.5}
ROTOR = 'rotor_inertia: {value: 0, unit: kg m2}'
ALL = {'com': -100, 'mass': 500, 'moment': 5e5, 'low': -90, 'high': 90}


@pytest.mark.parametrize(
    ('changed', 'units', 'why'),
    [
        (ALL, 'mm, g and degrees', 'gravity pulls at j1 with 4.9e+05 N m'),
        ({'com': -100, 'moment': 500.0}, 'mm', 'the centre of mass of l1 is 100 m from its joint'),
        ({'mass': 500, 'moment': 0.5}, 'g', 'l1 weighs 500 kg and is about 0.2 m large'),
        ({'low': -90, 'high': 90}, 'degrees', 'j1 turns from -90 to 90 rad'),
        ({'low': 0, 'high': 180}, 'degrees', 'j1 turns from 0 to 180 rad'),
        ({'com': -5, 'mass': 2000, 'moment': 5e4}, 'g', 'l1 weighs 2000 kg and gravity pulls at'),
    ],
)
def test_a_unit_is_asked_for_with_the_evidence(tmp_path, capsys, changed, units, why):
    path = tmp_path / 'r.urdf'
    path.write_text(LINK.format(**PLAIN | changed))
    assert main(['robot', 'init', str(path), '-o', str(tmp_path / 'r')]) == 0
    (said,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith('warning')]
    assert said.startswith(f'warning: is this file in {units}? ') and why in said
    assert main(['robot', 'init', str(path), '-o', str(tmp_path / 'json'), '--json']) == 0
    assert json.loads(capsys.readouterr().out)['warnings'] == [said.removeprefix('warning: ')]


def test_a_slide_of_many_metres_is_in_mm(tmp_path):
    (asked,) = skeleton_of(SLIDES.replace('upper="0.05"', 'upper="50"'), tmp_path).doubts
    assert asked.startswith('is this file in mm? left slides from 0 to 50 m')


@pytest.mark.parametrize('name', sorted(named_robots()))
def test_no_robot_of_ours_is_asked_about(name):
    robot = load_robot(name)
    loads = dict(zip(robot.joint_names, gravity_torque(robot).tolist(), strict=True))
    assert doubt(robot.links, robot.joints, loads) == ''


@pytest.mark.parametrize('text', [SLIDES, LINK.format(**PLAIN), (DATA / 'arm3.urdf').read_text()])
def test_nor_a_file_in_m_kg_and_rad(tmp_path, text):
    assert skeleton_of(text, tmp_path).doubts == ()


def test_rotors_that_are_filled_in_allow_longer_steps(tmp_path, capsys):
    folder = tmp_path / 'arm'
    light = make_folder(DATA / 'arm3.urdf', folder, 'voltage').robot
    path = folder / 'robot.yaml'
    text = path.read_text()
    assert ROTOR in text
    path.write_text(text.replace(ROTOR, 'rotor_inertia: {value: 0.05, unit: kg m2}'))
    assert main(['robot', 'step', str(folder), '--json']) == 0
    said = json.loads(capsys.readouterr().out)
    assert said['before'] == light.integration_step < said['integration_step']
    assert load_robot(folder).integration_step == said['integration_step']
    assert path.read_text().count('integration_step:') == 1


def test_a_name_is_no_folder_of_yours(capsys):
    assert main(['robot', 'step', 'pendulum']) == 2
    assert 'takes one of yours' in capsys.readouterr().err
