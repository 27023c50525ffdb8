# SPDX-License-Identifier: Apache-2.0
"""Joints that the motors of others turn too: angles, inertia, loads, and what is refused."""

import numpy as np
import pytest
from tests.robots import ARM, like

from leo_msgs_py.errors import UserError
from leo_sim.description.coupled import with_coupled
from leo_sim.kinematics.frames import Kinematics
from leo_sim.model import Model

DIFFERENTIAL = (('yaw', 'wrist', 0.6), ('wrist', 'yaw', -1.5))


def coupled(folder, *ratios):
    lines = ''.join(f'  {name}: {{turns_with: {{{motor}: {r}}}}}\n' for name, motor, r in ratios)
    return like(ARM, folder, ('start_poses:', f'joints:\n{lines}start_poses:'))


@pytest.mark.parametrize('ratios', [DIFFERENTIAL[:1], DIFFERENTIAL[1:], DIFFERENTIAL])
def test_it_moves_as_the_robot_does_whose_joints_have_the_angles_that_the_motors_make(
    ratios, tmp_path
):
    robot = coupled(tmp_path / 'robot', *ratios)
    assert robot.joint_names == ARM.joint_names and robot.moving_links == ARM.moving_links
    turning = np.eye(3)
    for name, motor, ratio in ratios:
        turning[ARM.joint_names.index(name), ARM.joint_names.index(motor)] = ratio
    motors, rates = np.array([0.4, 0.03, -0.7]), np.array([1.0, 0.2, -2.0])
    frames = [Kinematics(ARM.joints).frames(turning @ motors)[link.name] for link in ARM.links]
    own = [Kinematics(robot.joints).frames(motors)[link.name] for link in ARM.links]
    for one, other in zip(own, frames, strict=True):
        assert np.allclose(one.origin, other.origin) and np.allclose(one.rotation, other.rotation)
    mass, bias = Model(ARM).rigid.mass_and_bias(turning @ motors, turning @ rates)
    coupled_mass, coupled_bias = Model(robot).rigid.mass_and_bias(motors, rates)
    assert np.allclose(coupled_mass, turning.T @ mass @ turning)
    assert np.allclose(coupled_bias, turning.T @ bias)


def test_a_robot_without_such_joints_is_as_written():
    assert with_coupled(ARM.urdf, {'wrist': {}}, 'robot.urdf') == ARM.urdf


def test_a_motor_turns_its_rotor_and_the_friction_beside_it_alone(tmp_path):
    """From rest a torque moves what is behind each motor: M + J in motor angles."""
    robot = coupled(tmp_path / 'robot', ('wrist', 'yaw', 1.0))
    model = Model(robot, integration_step=1e-5)
    state, volts = model.start(), np.array([1.0, 0.0])  # of the wrist, of the yaw
    turning = np.array([[1, 0, 0], [0, 1, 0], [1, 0, 1]])
    mass, bias = Model(ARM).rigid.mass_and_bias(state.q, state.dq)
    mass = turning.T @ mass @ turning + np.diag(model.laws.rotor_inertia)
    pull = np.array([0.0, 0.0, 0.5 / 4])
    assert model.step(state, volts, 1e-5).dq == pytest.approx(
        1e-5 * np.linalg.solve(mass, pull - turning.T @ bias), rel=1e-3
    )


@pytest.mark.parametrize(
    ('ratio', 'said'),
    [
        (('wrist', 'elbow', 1), "joints.wrist.turns_with: .*no moving joint 'elbow'"),
        (('wrist', 'wrist', 1), "joints.wrist.turns_with: it turns with its own motor; take 'wri"),
        (('wrist', 'yaw', 0), "'wrist_by_yaw': <mimic>: multiplier 0"),
    ],
)
def test_what_cannot_be_is_one_line(ratio, said, tmp_path):
    with pytest.raises(UserError, match=said):
        coupled(tmp_path / 'robot', ratio)
