# SPDX-License-Identifier: Apache-2.0
"""SDF, read back by its own rules: poses, axes, inertia, torques, and what drives the motors."""

from functools import cache
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.hostile_names import folder_of
from tests.models import modelled

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.export.held import held
from leo_sim.export.sdf import sdf
from leo_sim.kinematics.frames import Kinematics
from leo_sim.model import Model


def exported(robot, *effects):
    root = sdf(held(modelled(robot, *effects, engine='rigid'), 'SDF').model)
    return ElementTree.fromstring(ElementTree.tostring(root)).find('model')


def vector(text):
    return np.array([float(part) for part in text.split()])


def posed(element):
    """What a `<pose>` says: 4 x 4, from roll, pitch and yaw about fixed axes."""
    found = np.eye(4)
    if element.find('pose') is not None:
        numbers = vector(element.findtext('pose'))
        found[:3, :3] = Rotation.from_euler('xyz', numbers[3:]).as_matrix()
        found[:3, 3] = numbers[:3]
    return found


def moved(joint, angle):
    axis, found = vector(joint.findtext('axis/xyz')), np.eye(4)
    if joint.get('type') == 'prismatic':
        found[:3, 3] = angle * axis
    else:
        found[:3, :3] = Rotation.from_rotvec(angle * axis).as_matrix()
    return found


def frames(model, angles):
    links = {link.get('name'): link for link in model.findall('link')}
    joints = {joint.findtext('child'): joint for joint in model.findall('joint')}

    @cache
    def at(name):
        joint, link = joints[name], links[name]
        if joint.findtext('parent') == 'world':
            return posed(link)
        assert link.find('pose').get('relative_to') == joint.findtext('parent')
        turned = np.eye(4)
        if joint.get('type') != 'fixed':
            turned = moved(joint, angles[joint.get('name')])
        return at(joint.findtext('parent')) @ posed(link) @ turned

    return {name: at(name) for name in links}


@pytest.mark.parametrize('name', ['so101', 'leo'])
def test_the_links_are_where_the_robot_has_them(name):
    robot = load_robot(name)
    q = np.random.default_rng(4).uniform(-1, 1, len(robot.joint_names))
    mine = frames(exported(name), dict(zip(robot.joint_names, q, strict=True)))
    ours = Kinematics(robot.joints).frames(q)
    if 'world' in ours:  # in SDF that is no link
        ours['world_link'] = ours.pop('world')
    assert set(mine) == set(ours)
    for link, frame in ours.items():
        np.testing.assert_allclose(mine[link][:3, 3], frame.origin, atol=1e-12)
        rotation = np.reshape(frame.rotation, (3, 3))
        np.testing.assert_allclose(mine[link][:3, :3], rotation, atol=1e-12)


def test_masses_and_inertia_are_those_of_the_model():
    found = exported('so101', ('link_mass', {'m': 0.1}))
    bodies = modelled('so101', ('link_mass', {'m': 0.1}), engine='rigid').laws.bodies
    for link in found.findall('link'):
        body, inside = bodies[link.get('name')], link.find('inertial')
        if not body.mass:
            assert float(inside.findtext('mass')) < 1e-3, 'SDF gives a link 1 kg by default'
            continue
        pose = posed(inside)
        assert float(inside.findtext('mass')) == pytest.approx(body.mass)
        np.testing.assert_allclose(pose[:3, 3], body.com)
        moments = np.diag([float(inside.findtext(f'inertia/i{x}')) for x in ('xx', 'yy', 'zz')])
        xx, yy, zz, xy, xz, yz = body.inertia
        whole = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
        turned = pose[:3, :3] @ moments @ pose[:3, :3].T
        np.testing.assert_allclose(turned, whole, atol=1e-9)


def test_friction_springs_and_the_back_emf_are_torques_of_the_joint():
    spring = ('joint_spring', {'k': 0.2, 'rest': 0.4})
    dry, viscous = ('coulomb_friction', {'c': 0.02}), ('viscous_friction', {'b': 0.01})
    model = exported('servo_pendulum', spring, dry, viscous, ('voltage_limit', {'v': 3.0}))
    joint = model.find("joint[@name='pivot']")
    values = {x.tag: float(x.text) for x in joint.find('axis/dynamics')}
    springs = {'spring_reference': 0.4, 'spring_stiffness': 0.2}
    dampers = {'damping': 0.01 + 0.354**2 / 3.4, 'friction': 0.02}
    assert values == pytest.approx(dampers | springs)
    assert float(joint.findtext('axis/limit/effort')) == pytest.approx(0.354 / 3.4 * 3.0)
    assert joint.find('axis/limit/velocity') is None, 'DART would enforce it'
    plugin = model.find('plugin')
    assert plugin.get('name') == 'gz::sim::systems::ApplyJointForce'
    assert plugin.findtext('joint_name') == 'pivot'


def test_a_position_servo_is_gazebos_controller():
    plugin = exported('xl330_pendulum').find('plugin')
    model = Model('xl330_pendulum')
    stall = model.robot.actuators[0].stall
    said = {x.tag: float(x.text) for x in plugin if x.tag != 'joint_name'}
    gain = stall * model.constants['actuators.pivot.position_gain']
    assert said == pytest.approx(
        {'p_gain': gain, 'i_gain': 0, 'd_gain': 0, 'cmd_max': stall, 'cmd_min': -stall}
    )


def test_a_link_and_a_joint_of_one_name_are_refused(tmp_path):
    same = folder_of(tmp_path / 'robot', 'bob')
    with pytest.raises(UserError, match="both named 'bob'"):
        sdf(Model(str(same)))
