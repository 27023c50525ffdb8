# SPDX-License-Identifier: Apache-2.0
"""Anyone's URDF brought to what a robot folder needs, with a note on all that was left out."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from leo_msgs_py.errors import UserError
from leo_sim.description.constants import outside

CONTROL = ('gazebo', 'transmission', 'ros2_control')
SHAPES = ('visual', 'collision')


@dataclass(frozen=True)
class Description:
    """A URDF without what no model uses.

    Attributes:
        name: Of the robot; empty where the URDF gives none.
        text: The URDF; as it was where nothing had to go.
        efforts, speeds: Largest torque N m (N) and rate rad/s (m/s) by joint, where given.
        frictions: Dry friction that was taken out, N m (N) by joint, as written.
        notes: What else was left out, one sentence each.
        rotors: Inertia of rotors by joint, kg m2, where given.
        springs: Stiffness N m/rad and rest rad by joint, where given.
        motors: Joints with an actuator; None where it is not said: then all have one.
        base: 'fixed' or 'planar'.
        gravity: m/s2.
    """

    name: str
    text: str
    efforts: Mapping[str, float]
    speeds: Mapping[str, float]
    frictions: Mapping[str, str]
    notes: tuple[str, ...]
    rotors: Mapping[str, float] = field(default_factory=dict)
    springs: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    motors: frozenset[str] | None = None
    base: str = 'fixed'
    gravity: float = 9.81


def read_urdf(path: Path, text: str, root: ElementTree.Element) -> Description:
    """Read a URDF, given as text and parsed; both are of the file at `path`.

    Raises:
        UserError: It is xacro, or a limit is no number.
    """
    if _is_xacro(root):
        raise UserError(
            f'{path} is xacro, not yet a URDF; expand it first: xacro {path} > robot.urdf'
        )
    efforts = _limits(root, 'effort', ('limit', 'N m'))
    speeds = _limits(root, 'velocity', ('goal_rate', 'rad/s'))
    frictions = _without_friction(root)
    notes = [*_without_control(root), *_without_meshes(root)]
    if notes or frictions:
        text = ElementTree.tostring(root, encoding='unicode') + '\n'
    return Description(root.get('name', ''), text, efforts, speeds, frictions, tuple(notes))


def _is_xacro(root: ElementTree.Element) -> bool:
    """Whether some tag or attribute still waits for xacro."""
    return any(
        'xacro' in element.tag or any('${' in v or '$(' in v for v in element.attrib.values())
        for element in root.iter()
    )


def _limits(root: ElementTree.Element, key: str, figure: tuple[str, str]) -> dict[str, float]:
    """Limits of joints by name; 0, and what no motor has, means that nobody knows."""
    found = {}
    for joint in root.findall('joint'):
        limit = joint.find('limit')
        try:
            value = float(limit.get(key, '0')) if limit is not None else 0.0
        except ValueError as error:
            raise UserError(f'joint {joint.get("name")!r}: limit {key}: {error}') from error
        if not outside(*figure, value):
            found[joint.get('name', '')] = value
    return found


def _without_control(root: ElementTree.Element) -> list[str]:
    found = [e for tag in CONTROL for e in root.findall(tag)]
    for element in found:
        root.remove(element)
    tags = ', '.join(sorted({f'<{e.tag}>' for e in found}))
    return [f'{tags} left out of robot.urdf: not used'] if found else []


def _without_meshes(root: ElementTree.Element) -> list[str]:
    """Drop shapes from mesh files, which a robot folder does not carry."""
    count = 0
    for link in root.findall('link'):
        for shape in [e for tag in SHAPES for e in link.findall(tag)]:
            if shape.find('geometry/mesh') is not None:
                link.remove(shape)
                count += 1
    return [f'{count} shapes from mesh files left out of robot.urdf: not used'] if count else []


def _without_friction(root: ElementTree.Element) -> dict[str, str]:
    """Drop dry friction, which is an effect here, and return it by joint."""
    found = {}
    for joint in root.findall('joint'):
        dynamics = joint.find('dynamics')
        friction = dynamics.attrib.pop('friction', '0') if dynamics is not None else '0'
        if friction.strip('0.'):
            found[joint.get('name', '')] = friction
    return found
