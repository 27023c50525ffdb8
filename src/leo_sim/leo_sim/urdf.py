# SPDX-License-Identifier: Apache-2.0
"""URDF to links and joints as plain numbers, and back with other inertial figures."""
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math
from xml.etree import ElementTree

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.effects.base import Body

KINDS = ('revolute', 'continuous', 'prismatic', 'fixed')
Vector = tuple[float, float, float]
Matrix = tuple[float, ...]


@dataclass(frozen=True)
class Link:
    """A rigid body: its name and inertial figures in its link frame."""

    name: str
    body: Body


@dataclass(frozen=True)
class Joint:
    """A joint of the tree, parents before children.

    Attributes:
        kind: 'revolute', 'continuous', 'prismatic' or 'fixed'.
        parent, child: Link names.
        rotation: Joint frame to parent link frame at angle 0, row by row.
        translation: Joint origin in the parent link frame, m.
        axis: Unit vector in the joint frame.
        limits: Lowest and highest angle rad (m), infinite for none.
        damping: N m s/rad (N s/m).
    """

    name: str
    kind: str
    parent: str
    child: str
    rotation: Matrix
    translation: Vector
    axis: Vector
    limits: tuple[float, float]
    damping: float


def parse(xml: str, source: str) -> tuple[tuple[Link, ...], tuple[Joint, ...]]:
    """Links and joints of a URDF, joints in order with parents first.

    Args:
        xml: The text of the URDF.
        source: Its file name, for messages.

    Raises:
        UserError: Not a URDF, or a joint that is not supported.
    """
    try:
        root = ElementTree.fromstring(xml)
    except ElementTree.ParseError as error:
        raise UserError(f'{source}: not an XML file: {error}') from error
    links = tuple(Link(e.get('name', ''), _body(e)) for e in root.findall('link'))
    joints = [_joint(e, source) for e in root.findall('joint')]
    return links, _sorted(joints, {link.name for link in links}, source)


def with_bodies(xml: str, bodies: Mapping[str, Body]) -> str:
    """The URDF with other inertial figures, joints without stops and damping.

    Written along principal axes, since PyBullet diagonalises only to a coarse tolerance; stops
    and damping are torques of the model.
    """
    root = ElementTree.fromstring(xml)
    for link in root.findall('link'):
        for old in link.findall('inertial'):
            link.remove(old)
        link.append(_inertial(link.get('name', ''), bodies[link.get('name', '')]))
    for joint in root.findall('joint'):
        for old in joint.findall('dynamics') + joint.findall('limit'):
            joint.remove(old)
        axis = joint.find('axis')
        if axis is not None and joint.get('type') != 'fixed':
            direction = np.array(_vector(axis.get('xyz')))
            axis.set('xyz', _written(direction / np.linalg.norm(direction)))
        if joint.get('type') == 'revolute':
            joint.set('type', 'continuous')
        if joint.get('type') == 'prismatic':
            free = {'lower': '1', 'upper': '-1', 'effort': '0', 'velocity': '0'}
            ElementTree.SubElement(joint, 'limit', free)
    return ElementTree.tostring(root, encoding='unicode')


def _vector(text: str | None, default: str = '0 0 0') -> Vector:
    x, y, z = (float(part) for part in (text or default).split())
    return x, y, z


def _rotation(rpy: Vector) -> np.ndarray:
    """Rotation matrix of fixed-axis roll, pitch, yaw."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                     [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                     [-sp, cp * sr, cp * cr]])


def _origin(element: ElementTree.Element) -> tuple[Vector, np.ndarray]:
    origin = element.find('origin')
    if origin is None:
        return (0.0, 0.0, 0.0), np.eye(3)
    rpy = _vector(origin.get('rpy'))
    return _vector(origin.get('xyz')), _rotation(rpy) if any(rpy) else np.eye(3)


def _body(link: ElementTree.Element) -> Body:
    inertial = link.find('inertial')
    if inertial is None:
        return Body(0.0, (0.0, 0.0, 0.0), (0.0,) * 6)
    com, rotation = _origin(inertial)
    mass, tensor = inertial.find('mass'), inertial.find('inertia')
    m = float(mass.get('value', '0')) if mass is not None else 0.0
    figures = tensor.attrib if tensor is not None else {}
    xx, yy, zz, xy, xz, yz = (float(figures.get(k, 0))
                              for k in ('ixx', 'iyy', 'izz', 'ixy', 'ixz', 'iyz'))
    full = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    return Body(m, com, (float(full[0, 0]), float(full[1, 1]), float(full[2, 2]),
                         float(full[0, 1]), float(full[0, 2]), float(full[1, 2])))


def _joint(element: ElementTree.Element, source: str) -> Joint:
    name, kind = element.get('name', ''), element.get('type', '')
    if kind not in KINDS:
        raise UserError(f'{source}: joint {name!r} is {kind!r}; supported: {", ".join(KINDS)}')
    ends = [element.find(tag) for tag in ('parent', 'child')]
    parent, child = (e.get('link', '') if e is not None else '' for e in ends)
    translation, rotation = _origin(element)
    axis = np.array(_vector(_attribute(element, 'axis', 'xyz'), '1 0 0'))
    if kind != 'fixed':
        axis = axis / np.linalg.norm(axis)
    if float(_attribute(element, 'dynamics', 'friction') or 0):
        raise UserError(f'{source}: joint {name!r} has dry friction; remove it there and add the '
                        'effect coulomb_friction to the model')
    x, y, z = axis.tolist()
    return Joint(name, kind, parent, child, tuple(rotation.ravel().tolist()), translation,
                 (x, y, z), _limits(element, kind),
                 float(_attribute(element, 'dynamics', 'damping') or 0))


def _attribute(element: ElementTree.Element, tag: str, key: str) -> str | None:
    found = element.find(tag)
    return None if found is None else found.get(key)


def _limits(element: ElementTree.Element, kind: str) -> tuple[float, float]:
    lower, upper = (float(_attribute(element, 'limit', k) or 0) for k in ('lower', 'upper'))
    bounded = kind in ('revolute', 'prismatic') and lower < upper
    return (lower, upper) if bounded else (-math.inf, math.inf)


def _sorted(joints: list[Joint], links: set[str], source: str) -> tuple[Joint, ...]:
    """Joints with parents before children; checks that they form one tree."""
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise UserError(f'{source}: joint {joint.name!r} names no link: {link!r}')
    reached = links - {joint.child for joint in joints}
    if len(reached) != 1:
        raise UserError(f'{source}: {len(reached)} root links, a robot has one: {sorted(reached)}')
    ordered: list[Joint] = []
    while len(ordered) < len(joints):
        following = [j for j in joints if j.parent in reached and j not in ordered]
        if not following:
            raise UserError(f'{source}: the joints form a loop')
        ordered.append(following[0])
        reached.add(following[0].child)
    return tuple(ordered)


def _inertial(name: str, body: Body) -> ElementTree.Element:
    xx, yy, zz, xy, xz, yz = body.inertia
    rotation = np.eye(3)
    moments = np.array([xx, yy, zz])
    if xy or xz or yz:
        moments, rotation = np.linalg.eigh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        rotation = rotation * np.sign(np.linalg.det(rotation))
    moments = _physical(name, body.mass, moments)
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[2, 1], rotation[2, 2]))
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    element = ElementTree.Element('inertial')
    ElementTree.SubElement(element, 'origin', {
        'xyz': _written(body.com), 'rpy': _written((roll, pitch, yaw))})
    ElementTree.SubElement(element, 'mass', {'value': repr(float(body.mass))})
    ElementTree.SubElement(element, 'inertia', {
        'ixx': repr(float(moments[0])), 'iyy': repr(float(moments[1])),
        'izz': repr(float(moments[2])), 'ixy': '0', 'ixz': '0', 'iyz': '0'})
    return element


def _physical(name: str, mass: float, moments: np.ndarray) -> np.ndarray:
    """Principal moments of a real body: PyBullet silently takes others for zero.

    Raises:
        UserError: Negative, or one larger than the other two together.
    """
    most = int(np.argmax(moments))
    others = moments.sum() - moments[most]
    if mass < 0 or moments.min() < 0 or moments[most] > others * (1 + 1e-9):
        raise UserError(f'link {name!r}: no body has the mass {mass:g} kg and the principal '
                        f'moments {moments} kg m2; use the engine rigid, or correct them')
    moments = moments.copy()
    moments[most] = min(moments[most], others)
    return moments


def _written(vector: Iterable[float]) -> str:
    return ' '.join(repr(float(component)) for component in vector)
