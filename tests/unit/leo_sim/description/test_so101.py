# SPDX-License-Identifier: Apache-2.0
"""The SO-101 arm: its figures are those its makers and BAM publish, and it holds itself up."""

import re

import numpy as np
import pytest

from leo_sim.description.robot import load_robot
from leo_sim.effects.motor import voltage_motor
from leo_sim.model import Model
from leo_sim.model.model_file import load_model, named_models

SO101 = load_robot('so101')
SETS = {name: file for name, file in named_models().items() if name.startswith('so101_')}
JOINTS = ('shoulder_pan', 'shoulder_lift', 'elbow_flex', 'wrist_flex', 'wrist_roll', 'gripper')


def test_joints_and_masses_are_those_of_the_makers():
    assert SO101.joint_names == JOINTS and SO101.input == 'position'
    masses = [link.body.mass for link in SO101.links if link.body.mass]
    assert sum(masses) == pytest.approx(0.100 + 0.103 + 0.104 + 0.079 + 0.087 + 0.012, abs=1e-4)
    assert SO101.bounds[0].tolist() == [-1.91986, -1.74533, -1.69, -1.65806, -2.74385, -0.174533]


def test_the_stall_torque_is_near_that_of_the_makers():
    """Of BAM's figures; the MuJoCo model of the makers stops at 3.35 N m."""
    (servo, *_) = SO101.actuators
    assert servo.supply * servo.torque_constant / servo.resistance == pytest.approx(3.5, abs=0.1)


def test_it_holds_its_arm_with_the_error_that_its_gain_leaves():
    model = Model(SO101, engine='rigid')
    state = model.start('nominal')
    for _ in range(100):
        state = model.step(state, np.zeros(6), 0.02)
    assert np.abs(state.dq).max() < 1e-6
    stiffness = 2.656 * 7.4 * 1.1776 / 2.4787  # N m/rad
    torque = model.rigid.load(state.q) - stiffness * state.q
    assert np.abs(torque).max() < 0.0515 + stiffness * 0.0016, 'friction and a count'
    assert 0.03 < state.q[1] < 0.1, 'the shoulder sags by some degrees'


BAM = 0.166 * 16  # duty for 1 rad: 0.166 for each 1 of P, which is 16
PUBLISHED = {
    'so101_robotstudio': (3.35, 17.8, 0.60, 0.028, 0.052),
    'so101_menagerie': (2.94, 998.22, 0.60 + 2.731, 0.028, 0.052),
    'so101_menagerie_so100': (3.5, 50.0, 5.128, 0.1, 0.1),
    'so101_open_duck': (3.23, 17.11, 0.56, 0.027, 0.068),
    'so101_bam': (0.97 * 3.516, BAM * 1.00494 * 3.516, 0.0599 + 0.5595, 0.02608, 0.0515),
    'so101_bam_m3': (0.97 * 3.816, BAM * 1.17871 * 3.816, 0.0315 + 0.6523, 0.0235, 0.05564),
    'so101_kscale_12v': (4.786, 0.16489 * 16 * 4.786, 0.0537 + 1.4357, 0.02696, 0.04363),
}
"""As MuJoCo counts them: N m, N m/rad, N m s/rad, kg m2 and N m at the joint."""


@pytest.mark.parametrize('name', PUBLISHED)
def test_a_set_has_the_published_stiffness_damping_and_force(name):
    force, kp, damping, armature, friction = PUBLISHED[name]
    values = load_model(name).constants
    servo = {
        key.rsplit('.', 1)[1]: value
        for key, value in values.items()
        if key.startswith('actuators.shoulder_pan.')
    }
    per_volt = servo['torque_constant'] / servo['resistance']
    most = servo['supply'] * per_volt
    lost = most * servo['rate_gain'] + servo['torque_constant'] * per_volt
    assert most == pytest.approx(force, rel=1e-3)
    assert most * servo['position_gain'] == pytest.approx(kp, rel=1e-3)
    assert lost + values['joints.shoulder_pan.damping'] == pytest.approx(damping, rel=1e-3)
    assert servo['rotor_inertia'] == pytest.approx(armature, rel=1e-3)
    assert values['joints.gripper.friction'] == pytest.approx(friction, rel=1e-3)


def test_a_set_is_a_model_by_name_and_says_where_it_was_published():
    assert SETS.keys() == PUBLISHED.keys()
    for name, file in SETS.items():
        assert re.search(r'commit\s(# )?[0-9a-f]{8}', file.read_text()), name


@pytest.mark.parametrize(
    ('name', 'kv', 'damping'),
    [
        ('so101_robotstudio', 0.0, 0.60),
        ('so101_menagerie', 2.731, 0.60),
        ('so101_menagerie_so100', 4.473, 0.0),
        ('so101_open_duck', 0.0, 0.56),
    ],
)
def test_a_set_of_mujoco_gives_the_torque_of_its_actuator(name, kv, damping):
    force, kp, *_ = PUBLISHED[name]
    rng = np.random.default_rng(1)
    goal, q, dq = rng.uniform([[-1], [-1], [-4]], [[1], [1], [4]], (3, 200))
    goal[100:] = q[100:] + 0.002 * goal[100:]
    laws, values = load_model(name).laws, load_model(name).constants
    at = np.eye(6)[5]
    volts = laws.servos.voltage(goal[:, None] * at, q[:, None] * at, dq[:, None] * at)[:, 5]
    figures = 'torque_constant', 'resistance'
    constant, resistance = (values[f'actuators.gripper.{name}'] for name in figures)
    torque = voltage_motor(volts, dq, constant, resistance).torque
    expected = np.clip(kp * (goal - q) - kv * dq, -force, force) - damping * dq
    assert torque == pytest.approx(expected, abs=5e-3)
