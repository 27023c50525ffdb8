# SPDX-License-Identifier: Apache-2.0
"""leo robot init takes an MJCF: the robot moves as MuJoCo moves it, or one line says why not."""

import sys

import numpy as np
import pytest
from tests.models import modelled
from tests.places import DATA
from tests.robots import skeleton_of

from leo_msgs_py.errors import UserError
from leo_sim.effects import place
from leo_sim.export.held import held
from leo_sim.export.mjcf import mjcf
from leo_sim.model import Model
from leo_sim.references.mjcf import written
from leo_sim.verbs.skeleton.folder import make_folder

mujoco = pytest.importorskip('mujoco')
ARM, WALKER, SERVOS = ((DATA / f'{name}.xml').read_text() for name in ('arm', 'walker', 'servos'))


def mass_and_bias(text, q, dq):
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = model.qpos0 + q, dq
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return mass - np.diag(model.dof_armature), data.qfrc_bias


def full_mass(model, q, dq):
    return model.rigid.mass_and_bias(np.asarray(q), np.asarray(dq))


def test_inertia_and_gravity_are_those_of_mujoco(tmp_path):
    model = Model(skeleton_of(ARM, tmp_path).robot, engine='rigid')
    assert model.robot.joint_names == ('shoulder', 'elbow', 'turn')
    for seed in range(5):
        q, dq = np.random.default_rng(seed).normal(size=(2, 3))
        for ours, theirs in zip(full_mass(model, q, dq), mass_and_bias(ARM, q, dq), strict=True):
            assert ours == pytest.approx(theirs, abs=1e-5)  # a light link between two joints


def test_motors_limits_and_friction(tmp_path):
    made = skeleton_of(ARM, tmp_path)
    robot = made.robot
    assert [a.joint for a in robot.actuators] == ['shoulder', 'turn']
    assert [a.limit for a in robot.actuators] == pytest.approx([6.0, 1.5])
    assert [a.rotor_inertia for a in robot.actuators] == [0.01, 0.01]
    assert robot.constants['joints.elbow.damping'].value == 0.05
    limits = {j.name: j.limits for j in robot.joints}
    assert limits['shoulder'] == pytest.approx(tuple(np.radians([-170, 170])))
    said = '\n'.join(made.notes)
    assert 'from the MJCF: 1 geoms, the gain and bias of the actuators of turn' in said
    spring = f'joint_spring:turn k=0.3 rest={np.radians(20):g}'
    assert f'leo add {tmp_path}/robot coulomb_friction:elbow c=0.02 {spring} -o' in said
    assert 'a ctrl of 1 in the MJCF is 2 N m at shoulder here' in said
    assert not any('rotor_inertia' in line for line in made.open)
    assert 'elbow has its angle 0 where the MJCF has its ref' in said


def test_a_planar_base(tmp_path):
    made = skeleton_of(WALKER, tmp_path)
    assert made.robot.base == 'planar'
    assert [a.joint for a in made.robot.actuators] == ['hip']
    assert 'not taken over from the MJCF: 3 geoms' in made.notes


def test_an_exported_model_comes_back(tmp_path):
    model = Model('double_pendulum', engine='rigid')
    model = model.changed(effects=[place(model.robot, 'link_mass', 'all', m=0.1)])
    text = written(mjcf(held(model, 'MJCF').model))
    back = Model(skeleton_of(text, tmp_path).robot, engine='rigid')
    q, dq = np.array([0.4, -0.9]), np.array([1.0, 2.0])
    for ours, theirs in zip(full_mass(back, q, dq), full_mass(model, q, dq), strict=True):
        assert ours == pytest.approx(theirs, rel=1e-9)


def test_delays_drag_lags_and_goal_rates_come_back(tmp_path):
    slow = ('command_delay', {'delay': 0.04}), ('measurement_delay', {'delay': 0.02})
    also = ('quadratic_drag', {'d': 0.1}), ('goal_rate', {'rate': 2.0})
    servo = modelled('xl330_pendulum', *slow, *also)
    made = skeleton_of(written(mjcf(held(servo, 'MJCF').model)), tmp_path / 'servo', '')
    words = 'quadratic_drag:pivot d=0.1 command_delay:pivot delay=0.04 measurement_delay:all'
    assert f'{words} delay=0.02 -o' in '\n'.join(made.notes)
    assert 'not taken over from the MJCF: 1 key frames' in made.notes
    assert Model(made.robot).constants['actuators.pivot.goal_rate'] == pytest.approx(2.0)
    motor = modelled('torque_pendulum', ('actuator_lag', {'tau': 0.03}))
    made = skeleton_of(written(mjcf(held(motor, 'MJCF').model)), tmp_path / 'motor')
    assert 'actuator_lag:pivot tau=0.03 -o' in '\n'.join(made.notes)


def test_motors_of_an_exported_model_come_back_and_others_say_their_sign(tmp_path):
    text = written(mjcf(held(Model('torque_pendulum', engine='rigid'), 'MJCF').model))
    made = skeleton_of(text, tmp_path)
    assert made.robot.limits == pytest.approx(Model('torque_pendulum').robot.limits)
    assert not any('gain and bias' in note or 'ctrl' in note for note in made.notes)
    (tmp_path / 'other').mkdir()
    turned = skeleton_of(WALKER.replace('<motor', '<motor gear="-10"'), tmp_path / 'other')
    assert 'a ctrl of 1 in the MJCF is -10 N m at hip here' in turned.notes


def test_servos_come_over_with_their_gains_and_go_back(tmp_path):
    made = skeleton_of(SERVOS, tmp_path, '')
    robot = made.robot
    assert robot.input == 'position' and robot.limits == pytest.approx([1.0, 3.0])
    assert not any('gain and bias' in note for note in made.notes)
    assert 'a ctrl of 1 in the MJCF is 0.5 rad at shoulder here' in made.notes
    damping = place(robot, 'servo_damping', 'elbow')
    assert (damping.parameters, damping.units) == ({'d': 0.1}, {'d': 'N m s/rad'})
    back = written(mjcf(held(Model(robot), 'MJCF').model))
    state = np.array([0.3, -0.2]), np.array([0.5, -1.0])
    for goal in np.array([[0.4, 0.1], [0.9, -2.5]]):
        ours = Model(robot).laws.torques(*state, state[1], goal, None, None).motor
        for text, ctrl in (SERVOS, goal * [2.0, 1.0]), (back, goal):
            model = mujoco.MjModel.from_xml_string(text)
            data = mujoco.MjData(model)
            data.qpos[:], data.qvel[:], data.ctrl[:] = *state, ctrl
            mujoco.mj_forward(model, data)
            assert ours == pytest.approx(data.qfrc_actuator, rel=1e-9)
    assert 'takes them over' in ' '.join(skeleton_of(SERVOS, tmp_path / 'other').notes)


@pytest.mark.parametrize(
    ('joint', 'said'), [('freejoint', 'is free'), ('joint type="ball"', 'is a ball')]
)
def test_joints_that_no_robot_here_has(tmp_path, joint, said):
    body = f'<body><{joint} name="j"/><geom size="0.1"/></body>'
    text = f'<mujoco><worldbody>{body}</worldbody></mujoco>'
    with pytest.raises(UserError, match=f"joint 'j' {said}"):
        skeleton_of(text, tmp_path)
    assert not (tmp_path / 'robot').exists()


@pytest.mark.parametrize('wrong', ['<nonsense/><actuator>', 'mass="nan"', 'mass="-1"'])
def test_a_file_that_mujoco_refuses_is_one_line_and_leaves_no_log(tmp_path, monkeypatch, wrong):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / 'file.xml'
    path.write_text(WALKER.replace('mass="1"' if 'mass' in wrong else '<actuator>', wrong))
    with pytest.raises(UserError, match=r'file.xml: MuJoCo refuses it: '):
        make_folder(path, tmp_path / 'robot', 'torque')
    assert [*tmp_path.iterdir()] == [path]


def test_without_mujoco(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    monkeypatch.delattr('leo_sim.references.mujoco', raising=False)
    monkeypatch.delitem(sys.modules, 'leo_sim.references.mujoco', raising=False)
    with pytest.raises(UserError, match=r'an MJCF needs the package mujoco: pip install'):
        skeleton_of(ARM, tmp_path)
