# SPDX-License-Identifier: Apache-2.0
"""The SO-101 arm: its figures are those its makers and BAM publish, and it holds itself up."""

import numpy as np
import pytest

from leo_sim.description.robot import load_robot
from leo_sim.model import Model

SO101 = load_robot('so101')
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
