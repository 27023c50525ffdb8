# SPDX-License-Identifier: Apache-2.0
"""leo robot init: a skeleton that loads at once and says what is left; else one clear line."""

import json
from pathlib import Path
import shlex

import numpy as np
import pytest
from tests.places import DATA
from tests.robots import skeleton_of, SLIDES

from leo_msgs_py import console
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.drivers import load_driver
from leo_sim.drivers.base import DriverOptions
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.model.model_file import load_model
from leo_sim.verbs.skeleton import figures
from leo_sim.verbs.skeleton.figures import EXACT, integration_step
from leo_sim.verbs.skeleton.folder import make_folder

ARM = DATA / 'arm3.urdf'
JOINTS = ('joint1', 'joint2', 'joint3')
AXIS = '<axis xyz="0 1 0"/>'
KINDS = ('torque', 'voltage', 'position')


def changed(folder: Path, *changes: tuple[str, str]) -> Path:
    text = ARM.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / 'changed.urdf'
    path.write_text(text)
    return path


@pytest.mark.parametrize('kind', KINDS)
def test_a_skeleton_loads_and_steps_at_once(tmp_path, kind):
    made = make_folder(ARM, tmp_path / 'arm', kind)
    robot = load_robot(tmp_path / 'arm')
    assert (robot.name, robot.input, robot.joint_names) == ('arm3', kind, JOINTS)
    assert robot.driver.bus is None
    assert [a.joint for a in robot.actuators] == list(JOINTS)
    assert next(j.limits for j in robot.joints if j.kind != 'fixed') == (-2.827, 2.827)
    model = load_model(tmp_path / 'arm')
    after = model.step(model.start(), np.zeros(3), 0.01)
    assert np.isfinite(after.dq).all() and after.dq[1] > 0
    assert any('control_period' in sentence for sentence in made.open)


def test_one_joint_is_a_robot_too(tmp_path):
    own = load_robot('pendulum')
    robot = skeleton_of(own.urdf, tmp_path, 'voltage').robot
    assert robot.joint_names == own.joint_names
    assert np.isfinite(Model(robot).step(Model(robot).start(), np.zeros(1), 0.01).dq).all()


def test_the_urdf_gives_limits_and_motor_figures(tmp_path):
    assert make_folder(ARM, tmp_path / 'torque', 'torque').robot.limits.tolist() == [1.0, 1.0, 1.0]
    for a in make_folder(ARM, tmp_path / 'volts', 'voltage').robot.actuators:
        assert a.torque_constant * a.limit / a.resistance == pytest.approx(1.0, rel=0.01)
        assert a.limit / a.torque_constant == pytest.approx(4.8, rel=0.01)


def test_a_long_chain_is_measured_in_fewer_states_and_said(tmp_path, capsys, monkeypatch):
    seen, said = [], []

    def rolled(model, q, *rest):
        while 'measuring the integration step (' not in ''.join(said):
            said.append(capsys.readouterr().err)
        seen.append(q.shape)
        return rollout(model, q, *rest)

    monkeypatch.setattr(console, 'EVERY', 0.001)
    monkeypatch.setattr(figures, 'rollout', rolled)
    skeleton_of(chain(40), tmp_path)
    assert {*seen} == {(30, 40)}


def chain(count: int) -> str:
    links = ''.join(
        f"""
<link name="l{i}"><inertial><origin xyz="0 0 -0.05"/><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j{i}" type="continuous"><origin xyz="0 0 -0.1"/><parent link="l{i - 1}"/>
<child link="l{i}"/><axis xyz="0 1 0"/></joint>"""
        for i in range(1, count + 1)
    )
    return f'<robot name="chain"><link name="l0"/>{links}</robot>'


def test_without_an_effort_gravity_says_what_the_motor_must_hold(tmp_path):
    made = make_folder(changed(tmp_path, ('effort="1" ', '')), tmp_path / 'arm', 'torque')
    load = np.abs(Model(made.robot, engine='rigid').rigid.load(np.array([[0.0, np.pi / 2, 0.0]])))
    assert made.robot.limits[1] > 1.9 * load[0, 1]
    assert made.robot.limits[0] == 1.0  # a vertical axis: gravity asks nothing of it
    assert any('joint2' in s and 'guess' in s for s in made.open)


def test_the_start_lies_within_limits_that_leave_out_0(tmp_path):
    urdf = changed(tmp_path, ('lower="-0.942"', 'lower="0.5"'))
    robot = make_folder(urdf, tmp_path / 'arm', 'torque').robot
    assert robot.start_poses['nominal'].angles['joint3'] == pytest.approx(0.941)


def test_the_integration_step_is_as_long_as_accuracy_allows(tmp_path):
    robot = make_folder(ARM, tmp_path / 'arm', 'torque').robot
    step, error = integration_step(robot)
    assert step == robot.integration_step and error < EXACT
    stiff = make_folder(ARM, tmp_path / 'volts', 'voltage').robot
    assert stiff.integration_step < step  # motors brake joints that hardly weigh


def test_what_no_model_uses_is_left_out_and_said(tmp_path):
    urdf = changed(tmp_path, ('velocity="4.8"/>', 'velocity="4.8"/><dynamics friction="0.02"/>'))
    made = make_folder(urdf, tmp_path / 'arm', 'torque')
    assert 'mesh' not in made.robot.urdf and 'transmission' not in made.robot.urdf
    (note,) = (note for note in made.notes if 'leo add' in note)
    *_, command = note.partition('leo ')
    assert main([*shlex.split(command)[:-1], str(tmp_path / 'model.yaml')]) == 0
    effects = load_model(tmp_path / 'model.yaml').effects
    assert [placed.where for placed in effects] == [(joint,) for joint in JOINTS]
    assert all(placed.parameters == {'c': 0.02} for placed in effects)


@pytest.mark.parametrize(
    ('changes', 'said'),
    [
        ([(AXIS, f'{AXIS}<mimic joint="joint9"/>')], "joint2.*mimics 'joint9', which is no joint"),
        ([('type="revolute"', 'type="floating"')], "joint1.*'floating'.*supported"),
        ([('type="revolute"', 'type="planar"')], "joint1.*'planar'.*supported"),
        ([('type="revolute"', 'type="fixed"')], 'no joint moves'),
        ([('<parent link="world"/>', '<parent link="floor"/>')], 'joint .*bolts.* names no link'),
        ([('<link name="world"/>', '<link name="world"/><link name="spare"/>')], '2 root links'),
        ([('<robot name="arm3">', '<robot name="${prefix}arm">')], 'xacro'),
        ([('<inertial>', '<i>'), ('</inertial>', '</i>')], "link 'link2', .*'joint1' .*no mass"),
        ([('lower="-1.791"', 'lower="2"')], 'joint2.*lower 2 is not below upper 1.571'),
        ([('lower="-1.791"', 'lower="1.571"')], 'joint2.*is not below upper.*or make it fixed'),
        ([('<mass value="0.0984"/>', '<mass value="heavy"/>')], "link2.*'heavy'"),
        ([('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>')], 'joint1.*direction'),
        ([('link name="link3"', 'link name="link2"')], "two links are named 'link2'"),
        ([('<?xml version="1.0"?>', 'not xml')], 'not an XML file'),
        ([('robot', 'sdf')], 'not <robot>'),
    ],
)
def test_what_is_no_robot_of_ours_is_one_line_and_nothing_written(tmp_path, changes, said):
    urdf = changed(tmp_path, *changes)
    with pytest.raises(UserError, match=said) as refusal:
        make_folder(urdf, tmp_path / 'arm', 'torque')
    assert '\n' not in str(refusal.value) and not (tmp_path / 'arm').exists()


def test_the_command_says_what_is_left_and_never_overwrites(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(['robot', 'init', str(ARM), '-o', 'arm']) == 0
    out = capsys.readouterr().out
    assert 'wrote arm/robot.urdf' in out and 'rotor_inertia' in out
    assert out.splitlines()[-1] == 'next: leo compare BAG --model arm'
    assert main(['robot', 'init', str(ARM), '-o', 'arm']) == 2
    assert 'arm is not empty' in capsys.readouterr().err
    assert main(['robot', 'init', 'none.urdf', '-o', 'new']) == 2
    assert 'cannot read none.urdf' in capsys.readouterr().err
    assert main(['robot', 'init', str(ARM), '-o', 'volts', '--input', 'voltage', '--json']) == 0
    data = json.loads(capsys.readouterr().out)
    assert data['limits'] == dict.fromkeys(JOINTS, 12.0) and data['left_to_fill_in']


def test_the_robots_with_a_name_are_listed(capsys):
    assert main(['robot', 'list', '--json']) == 0
    robots = {robot['name']: robot for robot in json.loads(capsys.readouterr().out)}
    assert robots['pendulum']['joints'] == ['pivot']


def test_a_joint_without_stops_is_said(tmp_path):
    changes = ('lower="-1.791" upper="1.571" ', ''), ('lower="-0.942"', 'lower="0"')
    made = make_folder(changed(tmp_path, *changes), tmp_path / 'arm', 'torque')
    limits = [joint.limits for joint in made.robot.joints if joint.independent]
    assert limits[1:] == [(-np.inf, np.inf), (0.0, 1.382)]
    assert 'no stops are given for joint2: taken to move without end' in made.notes


@pytest.mark.parametrize(
    ('family', 'kind'),
    [
        ('dynamixel', 'torque'),
        *((family, kind) for family in ('dynamixel', 'feetech') for kind in KINDS[1:]),
    ],
)
def test_a_bus_of_servos_is_there_to_be_filled_in(tmp_path, capsys, family, kind):
    words = ['robot', 'init', str(ARM), '-o', str(tmp_path / 'arm'), '--driver', family]
    assert main([*words, '--input', kind]) == 0
    robot = load_robot(tmp_path / 'arm')
    bus = robot.driver.bus
    assert robot.driver.family == family
    assert [servo.id for servo in bus.servos.values()] == [1, 2, 3]
    assert (bus.servos['joint1'].low, bus.servos['joint1'].high) == (-2.827, 2.827)
    assert (bus.servos['joint1'].torque_constant is not None) == (kind == 'torque')
    assert f'leo check-driver {family}' in capsys.readouterr().out
    assert load_driver(family, DriverOptions(robot)).info.joints == JOINTS


def test_feetech_servos_are_given_no_torques(tmp_path, capsys):
    words = ['robot', 'init', str(ARM), '-o', str(tmp_path / 'arm'), '--driver', 'feetech']
    assert main(words) == 2 and not (tmp_path / 'arm').exists()
    assert 'give --input voltage or position' in capsys.readouterr().err


def test_a_servo_that_takes_goals_holds_its_pose(tmp_path):
    made = make_folder(ARM, tmp_path / 'arm', 'position')
    assert any('position_gain' in sentence for sentence in made.open)
    model = Model(made.robot)
    state = model.start()
    for _ in range(100):
        state = model.step(state, np.array([0.3, 0.2, 0.4]), 0.01)
    assert np.abs(state.dq).max() < 0.01 and state.q[0] == pytest.approx(0.3, abs=1e-3)


def test_a_servo_turns_so_far_for_a_metre_of_a_slide(tmp_path):
    servos = skeleton_of(SLIDES, tmp_path, 'voltage', 'dynamixel').robot.driver.dynamixel.servos
    assert list(servos) == ['left'] and servos['left'].gear == pytest.approx(1 / 0.015, rel=0.01)
    assert 'gear of slides: rad of the servo per m' in (tmp_path / 'robot/robot.yaml').read_text()


def test_dry_friction_of_a_joint_that_mimics_is_added_at_its_leader(tmp_path):
    def rubbing(effort, friction):
        return f'effort="{effort}" velocity="1"/><dynamics friction="{friction}"/>'

    plain = 'effort="10" velocity="1"/>'
    left, right = SLIDES.split('<joint name="right"')
    left, right = left.replace(plain, rubbing(10, 0.2)), right.replace(plain, rubbing(10, 0.3))
    right = right.replace('<mimic joint="left"/>', '<mimic joint="left" multiplier="-2"/>')
    (note,) = skeleton_of(f'{left}<joint name="right"{right}', tmp_path).notes
    assert 'coulomb_friction:left c=0.8 ' in note
