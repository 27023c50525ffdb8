# SPDX-License-Identifier: Apache-2.0
"""LEO's two profiles against the data sheet, and its rigid-body dynamics against MuJoCo."""

import mujoco
import numpy as np
import pytest
from tests.robots import like

from leo_msgs_py.errors import UserError
from leo_sim.description.constants import bodies
from leo_sim.description.robot import load_robot
from leo_sim.dynamics.spatial import Spatial
from leo_sim.effects import place
from leo_sim.kinematics.frames import Kinematics
from leo_sim.kinematics.gait import Gait, Plane
from leo_sim.model import Model

LEO, ODE = load_robot('leo'), load_robot('leo_ode')
LEGS = tuple(f'{side}_{name}' for name in ('hip', 'knee', 'ankle') for side in ('left', 'right'))
JOINTS = ('base_x', 'base_z', 'torso_pitch', *LEGS)


def links_of(robot):
    values = {path: constant.value for path, constant in robot.constants.items()}
    return bodies(robot.links, robot.joints, values)


def bottoms(robot, q):
    frames = Kinematics(robot.joints).frames(q)
    return {c.name: frames[c.link].point((c.x, 0.0, c.z))[2] - c.radius for c in robot.contacts}


@pytest.mark.parametrize('robot', [LEO, ODE], ids=lambda r: r.name)
def test_joints_and_motors(robot):
    assert robot.joint_names == JOINTS
    assert tuple(a.joint for a in robot.actuators) == LEGS
    assert robot.limits.tolist() == [8.6] * 6
    assert (robot.base, robot.input, robot.control_period) == ('planar', 'voltage', 0.03)
    motor = robot.actuators[0]
    assert motor.torque_constant / motor.resistance == pytest.approx(0.292329, rel=1e-5)
    limits = {j.name: j.limits for j in robot.joints}
    assert limits['left_knee'] == (-2.617994, 0.034907)
    assert limits['right_hip'] == (-0.785398, 2.548181)
    assert limits['left_ankle'] == (-1.570796, 1.448623)


def test_masses():
    assert sum(body.mass for body in links_of(LEO).values()) == pytest.approx(1.85702, abs=1e-5)
    without_boom = sum(b.mass for name, b in links_of(ODE).items() if name != 'boom')
    assert without_boom == pytest.approx(1.76802, abs=1e-5)
    assert LEO.constants['links.torso.mass'].value == 0.94226


def test_boom_and_torso_together_are_the_merged_body_of_the_data_sheet():
    links = links_of(ODE)
    torso, boom = links['torso'], links['boom']
    place = np.array([0.00273, -0.120775])
    com = np.array([torso.com[0], torso.com[2]])
    mass = torso.mass + boom.mass
    merged = (torso.mass * com + boom.mass * place) / mass
    inertia = torso.inertia[1] + torso.mass * np.sum((com - merged) ** 2)
    inertia += boom.mass * np.sum((place - merged) ** 2)
    assert mass == pytest.approx(1.230991, abs=2e-6)
    assert merged == pytest.approx([-0.0000521, -0.0237952], abs=1e-6)
    assert inertia == pytest.approx(0.00870763, abs=1e-7)
    assert boom.force == (0.0, 0.0, -1.02692)


def test_losses_of_the_ode_profile():
    ideal, lossy = (Model(robot, engine='rigid').laws for robot in (LEO, ODE))
    at = np.zeros(9), np.zeros(9), np.zeros(9), np.full(6, 8.6), None, None
    assert ideal.torques(*at).motor[3:] == pytest.approx(2.514, abs=1e-3)
    assert lossy.torques(*at).motor[3:] == pytest.approx(0.75 * 2.514, abs=1e-3)
    assert lossy.torques(*at).level.tolist() == [0.0] * 3 + [0.2] * 6
    assert lossy.rotor_inertia.tolist() == [0.0] * 3 + [0.0039052] * 6
    assert not ideal.dry


def test_start_pose_stands_where_the_data_sheet_says():
    heights = bottoms(LEO, Model(LEO, engine='rigid').start('nominal').q)
    assert heights['left_heel'] == pytest.approx(0.40e-3, abs=0.01e-3)
    assert heights['left_toe'] == pytest.approx(0.24e-3, abs=0.01e-3)
    assert heights['right_heel'] > 0.05


@pytest.mark.parametrize('robot', [LEO, ODE], ids=lambda r: r.name)
def test_upright_it_is_as_tall_as_the_data_sheet_says(robot):
    tall = {'leo': 0.393865, 'leo_ode': 0.389865}[robot.name]
    q = np.zeros(9)
    q[1] = tall
    feet = {k: v for k, v in bottoms(robot, q).items() if 'heel' in k or 'toe' in k}
    assert list(feet.values()) == pytest.approx([0.0] * 4, abs=1e-12)


@pytest.mark.parametrize('robot', [LEO, ODE], ids=lambda r: r.name)
@pytest.mark.parametrize('pose', ['random', 'standing'])
def test_poses_on_the_ground_touch_it(robot, pose):
    model, rng = Model(robot, engine='rigid'), np.random.default_rng(0)
    for _ in range(50):
        state = model.start(pose, rng)
        assert min(bottoms(robot, state.q).values()) == pytest.approx(0.0, abs=1e-12)
        assert not state.dq.any()


def test_on_a_slope_it_starts_on_the_slope():
    uphill = Model(LEO, (place(LEO, 'ground_slope', 'ground', angle=0.1),), engine='rigid')
    assert Gait(LEO, 0.1).clearance(uphill.start('standing').q) == pytest.approx(0.0, abs=1e-12)
    assert max(uphill.contact_forces(uphill.start('standing')).values()) < 1e-6


def test_random_start_is_the_thesis():
    model, rng = Model(LEO, engine='rigid'), np.random.default_rng(1)
    drawn = np.array([model.start('random', rng).q for _ in range(400)]) - model.start().q
    spread = dict(zip(JOINTS, np.stack([drawn.min(axis=0), drawn.max(axis=0)], 1), strict=True))
    assert np.ptp(spread['torso_pitch']) == 0.0
    for joint in ('left_hip', 'right_hip', 'right_knee', 'left_ankle', 'right_ankle'):
        assert spread[joint] == pytest.approx([-0.0872, 0.0872], abs=2e-3)
    assert spread['left_knee'] == pytest.approx([-0.1744, 0.0], abs=2e-3)


def test_hanging_is_held_clear_of_the_ground():
    state = Model(LEO, engine='rigid').start('hanging')
    assert LEO.start_poses['hanging'].held
    assert min(bottoms(LEO, state.q).values()) > 0.1


def test_the_plane_is_the_tree():
    rng, plane, tree = np.random.default_rng(2), Plane(LEO.joints), Kinematics(LEO.joints)
    points = plane.points([(c.link, c.x, c.z) for c in LEO.contacts])
    q = rng.normal(0, 2, (20, 9))
    x, z = points(q)
    for row in range(20):
        frames = tree.frames(q[row])
        there = [frames[c.link].point((c.x, 0.0, c.z)) for c in LEO.contacts]
        assert x[row] == pytest.approx([p[0] for p in there])
        assert z[row] == pytest.approx([p[2] for p in there])
        links = links_of(LEO)
        moments = [b.mass * frames[name].point(b.com)[0] for name, b in links.items()]
        centre = sum(moments) / sum(b.mass for b in links.values())
        assert Gait(LEO).com_x(q[row]) == pytest.approx(centre)


def test_inverse_dynamics_are_those_of_mujoco():
    theirs = mujoco.MjModel.from_xml_string(LEO.urdf)
    theirs.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    theirs.opt.gravity[:] = 0, 0, -9.81
    data, ours = mujoco.MjData(theirs), Spatial(LEO.joints, links_of(LEO), 9.81)
    names = [theirs.joint(i).name for i in range(theirs.njnt)]
    order, rng = [names.index(name) for name in JOINTS], np.random.default_rng(3)
    for _ in range(1000):
        q, dq, ddq = rng.uniform(-2, 2, 9), rng.normal(0, 5, 9), rng.normal(0, 100, 9)
        data.qpos[order], data.qvel[order], data.qacc[order] = q, dq, ddq
        mujoco.mj_inverse(theirs, data)
        mass, bias = ours.mass_and_bias(q, dq)
        expected = data.qfrc_inverse[order]
        assert mass @ ddq + bias == pytest.approx(expected, abs=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize(
    ('q', 'message'),
    [
        (np.zeros(8), r'has 9 angles \(base_x, .*found 8'),
        ([0, 0.4, 0, 0, 0, 0.5, 0, 0, 0], r'knee is at 0\.5 rad, outside its stops -2\.618 to'),
        ([0, np.nan, 0, 0, 0, 0, 0, 0, 0], 'not finite'),
    ],
)
def test_impossible_states(q, message):
    with pytest.raises(UserError, match=message):
        Model(LEO, engine='rigid').state_from(q, np.zeros(9))


def test_a_state_is_set_and_read_back_exactly():
    rng = np.random.default_rng(4)
    model = Model(LEO, engine='rigid')
    q, dq = rng.uniform(-0.5, 0, 9), rng.normal(0, 3, 9)
    again = model.sense(model.state_from(q, dq))
    assert again[0].tolist() == q.tolist()
    assert again[1].tolist() == dq.tolist()


def test_wrong_inputs_are_one_line():
    model = Model(LEO, engine='rigid')
    with pytest.raises(UserError, match=r'leo takes 6 inputs .*found 5'):
        model.step(model.start(), np.zeros(5), 0.03)


def test_a_link_without_inertia_is_named(tmp_path):
    name = '<link name="left_shank">'
    shank = LEO.urdf.partition(name)[2].partition('</link>')[0]
    with pytest.raises(UserError, match=r"link 'left_shank', which joint .* has no mass"):
        like(LEO, tmp_path, (name + shank, name))
