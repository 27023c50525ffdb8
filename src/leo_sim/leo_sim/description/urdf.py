# SPDX-License-Identifier: Apache-2.0
"""URDF to links and joints as plain numbers, and back with other inertial figures."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from heapq import heappop, heappush
import math
from typing import TypeVar
from xml.etree.ElementTree import Element, fromstring, ParseError, SubElement, tostring

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import is_name
from leo_sim.description.constants import outside
from leo_sim.description.joint import Body as Body
from leo_sim.description.joint import coupled, mimics, Vector
from leo_sim.description.joint import Joint as Joint
from leo_sim.description.joint import Link as Link

BOUNDED = ('revolute', 'prismatic')
KINDS = (*BOUNDED, 'continuous', 'fixed')
AXIS = '1 0 0'  # where a URDF names none
TENSOR = 'ixx', 'iyy', 'izz', 'ixy', 'ixz', 'iyz'
Read = TypeVar('Read')


def parse(xml: str, source: str) -> tuple[tuple[Link, ...], tuple[Joint, ...]]:
    """Links and joints, parents first; UserError, with the file `source`: no URDF of ours."""
    root = root_of(xml, source)
    if root.tag != 'robot':
        raise UserError(f'{source}: not a URDF: it starts with <{root.tag}>, not <robot>')
    links = tuple(Link(e.get('name', ''), _named(e, source, _body)) for e in root.findall('link'))
    elements = root.findall('joint')
    joints = [_named(e, source, _joint) for e in elements]
    for kind, names in (('links', [x.name for x in links]), ('joints', [x.name for x in joints])):
        if twice := _twice(names):
            raise UserError(f'{source}: two {kind} are named {twice[0]!r}; names must differ')
    copied = {e.get('name', ''): c for e in elements if (c := _named(e, source, mimics))}
    try:
        joints = coupled(joints, copied)
    except ValueError as error:
        raise UserError(f'{source}: {error}') from error
    return links, _sorted(joints, {link.name for link in links}, source)


def root_of(xml: str, source: str) -> Element:
    try:
        return fromstring(xml)
    except (ParseError, ValueError) as error:
        raise UserError(f'{source}: not an XML file: {error}') from error


def _named(element: Element, source: str, read: Callable[[Element], Read]) -> Read:
    """What `read` makes of a link or joint, its ValueErrors with file and name."""
    name = element.get('name')
    if not name:
        raise UserError(f'{source}: a {element.tag} has no name; give it one')
    if not is_name(name):
        raise UserError(f'{source}: {element.tag} {name!r}: a name is one line of plain text')
    try:
        return read(element)
    except ValueError as error:
        raise UserError(f'{source}: {element.tag} {name!r}: {error}') from error


def with_bodies(xml: str, bodies: Mapping[str, Body]) -> str:
    """The URDF with other inertial figures, joints without stops and damping.

    Written along principal axes, since PyBullet diagonalises only to a coarse tolerance; stops
    and damping are torques of the model.
    """
    root = fromstring(xml)
    put_bodies(root, bodies)
    for joint in root.findall('joint'):
        for old in joint.findall('dynamics') + joint.findall('limit'):
            joint.remove(old)
        axis = joint.find('axis')
        if axis is not None and joint.get('type') != 'fixed':
            direction = np.array(_vector(axis.get('xyz'), AXIS))
            axis.set('xyz', numbers(direction / np.linalg.norm(direction)))
        if joint.get('type') == 'revolute':
            joint.set('type', 'continuous')
        if joint.get('type') == 'prismatic':
            free = {'lower': '1', 'upper': '-1', 'effort': '0', 'velocity': '0'}
            SubElement(joint, 'limit', free)
    return tostring(root, encoding='unicode')


def put_bodies(root: Element, bodies: Mapping[str, Body]) -> None:
    """Give links other inertial figures, along principal axes; UserError: no body has them."""
    links = {link.get('name', ''): link for link in root.findall('link')}
    for name, body in bodies.items():
        for old in links[name].findall('inertial'):
            links[name].remove(old)
        links[name].append(_inertial(name, body))


def _vector(text: str | None, default: str = '0 0 0') -> Vector:
    parts = [_number(part) for part in (text or default).split()]
    if len(parts) != 3:
        raise ValueError(f'{text!r} is no vector of three numbers')
    return parts[0], parts[1], parts[2]


def _number(text: str | None) -> float:
    value = float(text or 0)
    if not math.isfinite(value):
        raise ValueError(f'{text!r} is no finite number')
    return value


def _within(figure: str, unit: str, *values: float) -> None:
    if wrong := outside(figure, unit, *values):
        raise ValueError(f'{figure}: {wrong}')


def _rotation(rpy: Vector) -> np.ndarray:
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rpy(rotation: np.ndarray) -> Vector:
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0]))
    if math.hypot(rotation[0, 0], rotation[1, 0]) < 1e-9:  # roll and yaw turn about one axis
        return math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    return roll, pitch, math.atan2(rotation[1, 0], rotation[0, 0])


def origin(element: Element) -> tuple[Vector, np.ndarray]:
    found = element.find('origin')
    if found is None:
        return (0.0, 0.0, 0.0), np.eye(3)
    rpy = _vector(found.get('rpy'))
    return _vector(found.get('xyz')), _rotation(rpy) if any(rpy) else np.eye(3)


def _body(link: Element) -> Body:
    found = link.find('inertial')
    if found is None:
        return Body(0.0, (0.0, 0.0, 0.0), (0.0,) * 6)
    com, rotation = origin(found)
    mass, tensor = found.find('mass'), found.find('inertia')
    m = _number(mass.get('value')) if mass is not None else 0.0
    if m:  # a link without one is a frame
        _within('mass', 'kg', m)
    _within('origin', 'm', *com)
    figures = tensor.attrib if tensor is not None else {}
    xx, yy, zz, xy, xz, yz = (_number(figures.get(key)) for key in TENSOR)
    _within('inertia', 'kg m2', xx, yy, zz)
    full = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    xx, yy, zz, xy, xz, yz = full[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)].tolist()
    return Body(m, com, (xx, yy, zz, xy, xz, yz))


def _joint(element: Element) -> Joint:
    kind = element.get('type', '')
    if kind not in KINDS:
        raise ValueError(f'the type is {kind!r}; supported: {", ".join(KINDS)}')
    parent, child = (attribute(element, tag, 'link') or '' for tag in ('parent', 'child'))
    translation, rotation = origin(element)
    _within('origin', 'm', *translation)
    axis = np.array(_vector(attribute(element, 'axis', 'xyz'), AXIS))
    if kind != 'fixed':
        if not 1e-6 < np.linalg.norm(axis) < 1e6:
            raise ValueError(f'the axis {axis} is no direction')
        axis = axis / np.linalg.norm(axis)
    if _number(attribute(element, 'dynamics', 'friction')):
        raise ValueError(
            'it has dry friction; remove it there and add the effect coulomb_friction to the model'
        )
    x, y, z = axis.tolist()
    damping = _number(attribute(element, 'dynamics', 'damping'))
    _within('damping', 'N m s/rad', damping)
    frame = tuple(rotation.ravel().tolist()), translation, (x, y, z)
    ends = kind, parent, child
    return Joint(element.get('name', ''), *ends, *frame, _limits(element, kind), damping)


def attribute(element: Element, tag: str, key: str) -> str | None:
    found = element.find(tag)
    return None if found is None else found.get(key)


def _limits(element: Element, kind: str) -> tuple[float, float]:
    """Its stops; both at 0, which is what a URDF without them says, are none."""
    lower, upper = (_number(attribute(element, 'limit', k)) for k in ('lower', 'upper'))
    if kind not in BOUNDED or lower == upper == 0:
        return -math.inf, math.inf
    if lower >= upper:
        raise ValueError(
            f'limit: lower {lower:g} is not below upper {upper:g}; correct them, or make it fixed'
        )
    return lower, upper


def _sorted(joints: list[Joint], links: set[str], source: str) -> tuple[Joint, ...]:
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise UserError(f'{source}: joint {joint.name!r} names no link: {link!r}')
    children = [joint.child for joint in joints]
    if loops := _twice(children):
        raise UserError(f'{source}: link {loops[0]!r} has two parents; a robot is a tree')
    reached = links - set(children)
    if len(reached) != 1:
        raise UserError(f'{source}: {len(reached)} root links, a robot has one: {sorted(reached)}')
    below: dict[str, list[int]] = {}
    for number, joint in enumerate(joints):
        below.setdefault(joint.parent, []).append(number)
    ordered: list[Joint] = []
    following = below.get(reached.pop(), [])  # numbers in the file, a heap
    while following:
        joint = joints[heappop(following)]
        ordered.append(joint)
        for number in below.get(joint.child, []):
            heappush(following, number)
    if len(ordered) < len(joints):
        raise UserError(f'{source}: the joints form a loop')
    return tuple(ordered)


def _twice(names: Iterable[str]) -> list[str]:
    return sorted(name for name, count in Counter(names).items() if count > 1)


def _inertial(name: str, body: Body) -> Element:
    xx, yy, zz, xy, xz, yz = body.inertia
    rotation = np.eye(3)
    moments = np.array([xx, yy, zz])
    if xy or xz or yz:
        moments, rotation = np.linalg.eigh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        rotation = rotation * np.sign(np.linalg.det(rotation))
    moments = _physical(name, body.mass, moments)
    return inertial(body.mass, body.com, moments, rotation)


def inertial(
    mass: float, com: Iterable[float], moments: Iterable[float], rotation: np.ndarray
) -> Element:
    element = Element('inertial')
    SubElement(element, 'origin', {'xyz': numbers(com), 'rpy': numbers(rpy(rotation))})
    SubElement(element, 'mass', {'value': repr(float(mass))})
    figures = *(repr(float(moment)) for moment in moments), '0', '0', '0'
    SubElement(element, 'inertia', dict(zip(TENSOR, figures, strict=True)))
    return element


def _physical(name: str, mass: float, moments: np.ndarray) -> np.ndarray:
    """Principal moments of a real body, or UserError: PyBullet silently takes others for zero."""
    most = int(np.argmax(moments))
    others = moments.sum() - moments[most]
    if mass < 0 or moments.min() < 0 or moments[most] > others * (1 + 1e-9):
        raise UserError(
            f'link {name!r}: no body has the mass {mass:g} kg and the principal '
            f'moments {moments} kg m2; correct them'
        )
    moments = moments.copy()
    moments[most] = min(moments[most], others)
    return moments


def numbers(vector: Iterable[float]) -> str:
    """Numbers as an attribute, to the last bit."""
    return ' '.join(repr(float(component)) for component in vector)
