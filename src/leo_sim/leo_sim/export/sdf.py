# SPDX-License-Identifier: Apache-2.0
"""A model as SDFormat, for Gazebo: its joints' figures and the systems that drive them.

A link's frame is its joint's, placed in its parent's; axes are in the joint's frame. DART, which
is Gazebo's engine, takes `damping`, `friction` (dry, of one level) and the spring as torques.
"""

from xml.etree.ElementTree import Comment, Element, fromstring, SubElement

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.description.joint import Joint
from leo_sim.description.robot import Robot
from leo_sim.description.urdf import numbers, origin, put_bodies, rpy, TENSOR
from leo_sim.export.figures import Figures, figures, loop_gains, refuse_mimics, strengths
from leo_sim.model.model import Model

VERSION = '1.11'
WORLD = 'world'
LEAST_MASS, LEAST_INERTIA = 1e-6, 1e-9
"""Of links without mass, kg and kg m2: SDFormat gives them 1 kg, and takes no zero."""
SIZES = {'box': ('size',), 'sphere': ('radius',), 'cylinder': ('radius', 'length'), 'mesh': ()}
FORCE = 'gz-sim-apply-joint-force-system', 'gz::sim::systems::ApplyJointForce'
SERVO = 'gz-sim-joint-position-controller-system', 'gz::sim::systems::JointPositionController'


def sdf(model: Model) -> Element:
    """A model whose laws SDFormat holds (see `held`); UserError: joints or names it does not."""
    robot, found = model.robot, figures(model)
    _check(robot)
    root = Element('sdf', version=VERSION)
    top = SubElement(root, 'model', name=robot.name)
    into = {joint.child: joint for joint in robot.joints}
    urdf = fromstring(robot.urdf)
    put_bodies(urdf, {name: b for name, b in found.laws.bodies.items() if b.mass})
    for link in urdf.findall('link'):
        _link(top, link, into.get(link.get('name', '')))
    base = next(j.parent for j in robot.joints if j.parent not in into)
    fixed = SubElement(top, 'joint', name=f'{base}_in_the_world', type='fixed')
    _texts(fixed, parent=WORLD, child=_free(base))
    for joint in robot.joints:
        _joint(top, joint, robot, found)
    for i in range(len(robot.actuators)):
        _system(top, robot, found, i)
    return root


def _check(robot: Robot) -> None:
    refuse_mimics(robot, 'SDF', ', which Gazebo reads too')
    links, joints = ({part.name for part in parts} for parts in (robot.links, robot.joints))
    base = next(iter(links - {j.child for j in robot.joints}))
    for name in sorted(links & (joints | {f'{base}_in_the_world'})):
        raise UserError(
            f'a link and a joint are both named {name!r}, which SDF does not take; '
            'rename one in the URDF'
        )


def _free(link: str) -> str:
    return f'{WORLD}_link' if link == WORLD else link


def _link(top: Element, link: Element, joint: Joint | None) -> None:
    element = SubElement(top, 'link', name=_free(link.get('name', '')))
    if joint is not None:
        pose = _pose(element, joint.translation, np.reshape(joint.rotation, (3, 3)))
        pose.set('relative_to', _free(joint.parent))
    _inertial(element, link.find('inertial'))
    for tag in ('visual', 'collision'):
        for number, shape in enumerate(link.findall(tag)):
            _shape(element, shape, f'{tag}_{number}')


def _inertial(element: Element, inertial: Element | None) -> None:
    """Figures along the principal axes, as `put_bodies` leaves them."""
    inside = SubElement(element, 'inertial')
    mass, moments = LEAST_MASS, dict.fromkeys(TENSOR[:3], repr(LEAST_INERTIA))
    if inertial is not None:
        _pose(inside, *origin(inertial))
        weight, tensor = inertial.find('mass'), inertial.find('inertia')
        assert weight is not None and tensor is not None
        mass = float(weight.get('value', 0))
        moments = {key: tensor.get(key, '0') for key in TENSOR}
    _texts(inside, mass=repr(mass))
    _texts(SubElement(inside, 'inertia'), **moments)


def _shape(element: Element, shape: Element, name: str) -> None:
    geometries = shape.find('geometry')
    found = None if geometries is None else next(iter(geometries), None)
    if found is None or found.tag not in SIZES:
        return
    inside = SubElement(element, shape.tag, name=name)
    _pose(inside, *origin(shape))
    geometry = SubElement(SubElement(inside, 'geometry'), found.tag)
    if found.tag == 'mesh':
        uri = found.get('filename', '').replace('package://', 'model://', 1)
        _texts(geometry, uri=uri, scale=found.get('scale', '1 1 1'))
    else:
        _texts(geometry, **{key: found.get(key, '0') for key in SIZES[found.tag]})


def _joint(top: Element, joint: Joint, robot: Robot, found: Figures) -> None:
    """Its axis, stops and torques; no limit of its rate, which DART would enforce."""
    bounded = np.isfinite(joint.limits[0])
    kind = 'continuous' if joint.kind == 'revolute' and not bounded else joint.kind
    element = SubElement(top, 'joint', name=joint.name, type=kind)
    _texts(element, parent=_free(joint.parent), child=_free(joint.child))
    if joint.kind == 'fixed':
        return
    axis = SubElement(element, 'axis')
    _texts(axis, xyz=numbers(joint.axis))
    limit, i = SubElement(axis, 'limit'), robot.joint_names.index(joint.name)
    if bounded:
        _texts(limit, lower=repr(joint.limits[0]), upper=repr(joint.limits[1]))
    damping = found.damping[i]
    if i in robot.actuated:
        a = robot.actuated.index(i)
        damping = damping + found.drives.back_emf[a]
        _texts(limit, effort=repr(float(strengths(robot, found)[a])))
    figures_of = {
        'damping': damping,
        'friction': found.friction[i],
        'spring_reference': found.rest[i],
        'spring_stiffness': found.stiffness[i],
    }
    _texts(SubElement(axis, 'dynamics'), **{k: repr(float(v)) for k, v in figures_of.items()})


def _system(top: Element, robot: Robot, found: Figures, i: int) -> None:
    joint, drive = robot.actuators[i].joint, found.drives
    filename, name = SERVO if robot.input == 'position' else FORCE
    plugin = SubElement(top, 'plugin', filename=filename, name=name)
    _texts(plugin, joint_name=joint)
    if robot.input == 'position':
        kp, kv, _ = (float(gains[i]) for gains in loop_gains(found))
        most = float(strengths(robot, found)[i])
        values = {'p_gain': kp, 'i_gain': 0.0, 'd_gain': kv, 'cmd_max': most, 'cmd_min': -most}
        _texts(plugin, **{key: repr(value) for key, value in values.items()})
    elif robot.input == 'voltage':
        gain = float(drive.gain[i] * drive.scale[i])
        plugin.append(Comment(f' the command in V x {gain!r} N m/V '))


def _pose(element: Element, place: tuple[float, ...], rotation: np.ndarray) -> Element:
    pose = SubElement(element, 'pose')
    pose.text = numbers((*place, *rpy(rotation)))
    return pose


def _texts(element: Element, **values: str) -> None:
    for tag, text in values.items():
        SubElement(element, tag).text = text
