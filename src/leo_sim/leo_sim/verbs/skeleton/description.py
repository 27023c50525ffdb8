# SPDX-License-Identifier: Apache-2.0
"""Anyone's URDF brought to what a robot folder needs, with a note on all that was left out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree.ElementTree import Element, fromstring, tostring

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_sim.description.constants import outside
from leo_sim.description.urdf import attribute

CONTROL = ('gazebo', 'transmission', 'ros2_control')
SHAPES = ('visual', 'collision')


@dataclass(frozen=True)
class Description:
    """A URDF without what no model uses; figures by joint, where given."""

    name: str  # of the robot; empty where the URDF gives none
    text: str  # the URDF; as it was where nothing had to go
    efforts: Mapping[str, float]  # largest torque, N m (N)
    speeds: Mapping[str, float]  # largest rate, rad/s (m/s)
    frictions: Mapping[str, str]  # dry friction that was taken out, N m (N), as written
    notes: tuple[str, ...]  # what else was left out, one sentence each
    rotors: Mapping[str, float] = field(default_factory=dict)  # inertia, kg m2
    # where every motor is a position servo: N m/rad, N m s/rad, furthest goal rad (0: not said),
    # largest rate of the goal rad/s (0: none)
    loops: Mapping[str, tuple[float, float, float, float]] = field(default_factory=dict)
    # what else is an effect here, by its name and joint (or 'all')
    effects: Mapping[tuple[str, str], Mapping[str, float]] = field(default_factory=dict)
    motors: frozenset[str] | None = None  # joints with an actuator; None: all of them
    base: str = 'fixed'  # or 'planar'
    gravity: float = 9.81  # m/s2


def read_urdf(path: Path, text: str, root: Element) -> Description:
    values = (value for element in root.iter() for value in element.attrib.values())
    called = any('xacro' in element.tag for element in root.iter())
    if called or any('${' in value or '$(' in value for value in values):
        raise UserError(
            f'{path} is xacro, not yet a URDF; expand it first: xacro {path} > robot.urdf'
        )
    efforts = _limits(root, 'effort', ('limit', 'N m'))
    speeds = _limits(root, 'velocity', ('goal_rate', 'rad/s'))
    frictions = _without_friction(root)
    notes = [*_without_control(root), *_without_meshes(root)]
    if notes or frictions:
        text = tostring(root, encoding='unicode') + '\n'
    return Description(root.get('name', ''), text, efforts, speeds, frictions, tuple(notes))


def _limits(root: Element, key: str, figure: tuple[str, str]) -> dict[str, float]:
    """Limits of joints by name; 0, and what no motor has, means that nobody knows."""
    found = {}
    for joint in root.findall('joint'):
        said = attribute(joint, 'limit', key)
        try:
            value = 0.0 if said is None else float(said)
        except ValueError as error:
            raise UserError(f'joint {joint.get("name")!r}: limit {key}: {error}') from error
        if not outside(*figure, value):
            found[joint.get('name', '')] = value
    return found


def _without_control(root: Element) -> list[str]:
    found = [e for tag in CONTROL for e in root.findall(tag)]
    for element in found:
        root.remove(element)
    tags = ', '.join(sorted({f'<{e.tag}>' for e in found}))
    return [f'{tags} left out of robot.urdf: not used'] if found else []


def _without_meshes(root: Element) -> list[str]:
    count = 0
    for link in root.findall('link'):
        for shape in [e for tag in SHAPES for e in link.findall(tag)]:
            if shape.find('geometry/mesh') is not None:
                link.remove(shape)
                count += 1
    return [f'{count} shapes from mesh files left out of robot.urdf: not used'] if count else []


def _without_friction(root: Element) -> dict[str, str]:
    found = {}
    for joint in root.findall('joint'):
        dynamics = joint.find('dynamics')
        friction = dynamics.attrib.pop('friction', '0') if dynamics is not None else '0'
        if friction.strip('0.'):
            found[joint.get('name', '')] = friction
    return found


def without(description: Description, links: Sequence[str], source: str) -> Description:
    root = fromstring(description.text)
    joints = root.findall('joint')
    known = [link.get('name', '') for link in root.findall('link')]
    for link in links:
        _check(link, known, joints, source)
    gone = _beyond(set(links), joints)
    lost = {joint.get('name', '') for joint in joints if _end(joint, 'child') in gone}
    _check_copies(joints, lost, source)
    for element in list(root):
        name = element.get('name')
        if (element.tag == 'link' and name in gone) or (element.tag == 'joint' and name in lost):
            root.remove(element)
    motors = description.motors
    note = f'{", ".join(n for n in known if n in gone)} left out with '
    note += f'{", ".join(j.get("name", "") for j in joints if j.get("name") in lost)}'
    return replace(
        description,
        text=tostring(root, encoding='unicode') + '\n',
        frictions={j: c for j, c in description.frictions.items() if j not in lost},
        loops={j: loop for j, loop in description.loops.items() if j not in lost},
        effects={at: p for at, p in description.effects.items() if at[1] not in lost},
        motors=None if motors is None else motors - lost,
        notes=(*description.notes, note),
    )


def _check(link: str, known: Sequence[str], joints: Sequence[Element], source: str) -> None:
    if link not in known:
        child = next((_end(j, 'child') for j in joints if j.get('name') == link), '')
        hint = f'; it is a joint, whose link is {child!r}' if child else nearest(link, known)
        raise UserError(f'--without: {source} has no link {link!r}{hint}')
    if link not in {_end(joint, 'child') for joint in joints}:
        raise UserError(f'--without: {link!r} is the root of {source}; nothing would be left')


def _check_copies(joints: Sequence[Element], lost: set[str], source: str) -> None:
    for joint in joints:
        copied = attribute(joint, 'mimic', 'joint')
        if copied in lost and joint.get('name') not in lost:
            raise UserError(
                f'{source}: joint {joint.get("name")!r} mimics {copied!r}, which --without '
                f'takes out; take it out too: --without {_end(joint, "child")}'
            )


def _beyond(gone: set[str], joints: Sequence[Element]) -> set[str]:
    while more := {_end(j, 'child') for j in joints if _end(j, 'parent') in gone} - gone:
        gone = gone | more
    return gone


def _end(joint: Element, tag: str) -> str:
    return attribute(joint, tag, 'link') or ''
