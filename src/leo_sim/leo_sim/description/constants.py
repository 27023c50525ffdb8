# SPDX-License-Identifier: Apache-2.0
"""Constants of a robot: every number of robot.yaml and robot.urdf that a model may override.

And in which range each of them lies, whatever file says it: what no robot leaves.
"""

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import Quantity
from leo_sim.description.joint import Body, Joint, Link, sliding
from leo_sim.description.robot_file import LENGTH, RobotFile

BODY_UNITS = {'mass': 'kg', 'com_x': 'm', 'com_y': 'm', 'com_z': 'm', 'inertia': 'kg m2'}
MOTOR_UNITS = {'torque_constant': 'N m/A', 'resistance': 'ohm', 'supply': 'V'}
SERVO_UNITS = {
    'position_gain': '1/rad',
    'rate_gain': 's/rad',
    'resolution': 'rad',
    'goal_rate': 'rad/s',
}
TORQUE_LOOP = {'stiffness': 'N m/rad', 'damping': 'N m s/rad', 'effort': 'N m'}
"""Of servos whose loop is given in N m, and that no motor figures are known of."""
INPUT_UNITS = {'voltage': 'V', 'torque': 'N m', 'position': 'rad'}
"""What an actuator takes -> its unit."""
NEEDED = {
    'voltage': tuple(MOTOR_UNITS),
    'torque': (),
    'position': (*MOTOR_UNITS, 'position_gain'),
    'torque loop': ('stiffness', 'effort'),
}
"""Figures without which an actuator makes no torque of its input."""
ZERO = {
    'voltage': ('rotor_inertia',),
    'torque': ('rotor_inertia',),
    'position': ('rotor_inertia', 'rate_gain', 'resolution'),
    'torque loop': ('rotor_inertia', 'damping', 'resolution'),
}
"""Figures of an actuator that are 0 where robot.yaml does not say them."""
GROUND_UNITS = {'stiffness': 'N/m', 'damping': 'N s/m', 'friction': '', 'slope': 'rad'}
BUS_UNITS = {'current_limit': 'A', 'torque_constant': 'N m/A', 'watchdog': 's'}
UNITS = {
    **BODY_UNITS,
    **MOTOR_UNITS,
    **SERVO_UNITS,
    **TORQUE_LOOP,
    'efficiency': '',
    'rotor_inertia': 'kg m2',
    'gravity': 'm/s2',
    'offset': 'rad',
    'force_x': 'N',
    'force_z': 'N',
}
COM = ('com_x', 'com_y', 'com_z')
DAMPING = 'N m s/rad'
OF_JOINTS = ('actuators', 'joints', 'sensors')
"""Groups of constants whose units are those of sliding where the joint slides."""
RANGES = {
    ('mass', 'kg'): (1e-9, 1e6),
    **dict.fromkeys([('origin', 'm'), *((com, 'm') for com in COM), ('offset', 'm')], LENGTH),
    ('inertia', 'kg m2'): (0.0, 1e9),
    **dict.fromkeys([('rotor_inertia', 'kg m2'), ('rotor_inertia', 'kg')], (0.0, 1e9)),
    **dict.fromkeys([('force_x', 'N'), ('force_z', 'N')], (-1e9, 1e9)),
    ('gravity', 'm/s2'): (-1e3, 1e3),
    **dict.fromkeys([('limit', 'V'), ('limit', 'rad'), ('supply', 'V')], (1e-6, 1e6)),
    **dict.fromkeys([('limit', 'N m'), ('limit', 'N')], (1e-9, 1e9)),
    ('limit', 'm'): (1e-6, 1e4),
    **dict.fromkeys([('torque_constant', 'N m/A'), ('torque_constant', 'N/A')], (1e-9, 1e6)),
    ('resistance', 'ohm'): (1e-6, 1e6),
    ('efficiency', ''): (1e-3, 1.0),
    **dict.fromkeys([('position_gain', '1/rad'), ('position_gain', '1/m')], (1e-6, 1e9)),
    **dict.fromkeys([('rate_gain', 's/rad'), ('rate_gain', 's/m')], (0.0, 1e6)),
    **dict.fromkeys([('resolution', 'rad'), ('resolution', 'm')], (0.0, 10.0)),
    **dict.fromkeys([('goal_rate', 'rad/s'), ('goal_rate', 'm/s')], (1e-6, 1e6)),
    ('stiffness', 'N m/rad'): (1e-6, 1e9),
    **dict.fromkeys([('effort', 'N m'), ('effort', 'N')], (1e-9, 1e9)),
    **dict.fromkeys([('damping', 'N m s/rad'), ('damping', 'N s/m')], (0.0, 1e9)),
    **dict.fromkeys([('friction', 'N m'), ('friction', 'N')], (0.0, 1e9)),
    ('offset', 'rad'): (-1e6, 1e6),
    ('stiffness', 'N/m'): (1e-3, 1e12),
    ('friction', ''): (0.0, 1e3),
    ('slope', 'rad'): (-1.5, 1.5),
    ('current_limit', 'A'): (1e-6, 1e6),
    ('watchdog', 's'): (1e-3, 1e3),
}
"""(figure, unit) -> its lowest and highest value in that unit."""


@dataclass(frozen=True)
class Constant:
    """A number of robot.yaml that a model file may override."""

    path: str  # as `actuators.pivot.resistance`
    value: float
    unit: str
    uncertain: tuple[float, float] | None = None  # range it is known to lie in; None: it is exact
    per_recording: bool = False  # each recording has a value of its own, as of a payload
    known: frozenset[str] = frozenset()  # recordings whose own value is known, and not refitted
    recording: str = ''  # name of the one that a value was refitted for

    @property
    def label(self) -> str:
        return f'{self.path} of {self.recording}' if self.recording else self.path


def constants_of(
    folder: Path, file: RobotFile, links: tuple[Link, ...], joints: tuple[Joint, ...]
) -> dict[str, Constant]:
    """All constants by path: defaults of the URDF, then what robot.yaml says.

    UserError: a wrong unit or value, or a motor figure that is missing.
    """
    found = {c.path: c for c in _urdf_constants(links, joints)}
    slides = {joint.name for joint in joints if joint.kind == 'prismatic'}
    for path, quantity in _given(file):
        unit = _unit(path, file.input, slides)
        found[path] = checked(str(folder / 'robot.yaml'), path, quantity, unit)
    for name, actuator in file.actuators.items():
        kind = 'torque loop' if actuator.stiffness else file.input
        for key in NEEDED[kind]:
            if f'actuators.{name}.{key}' not in found:
                raise UserError(f'{folder / "robot.yaml"}: actuators.{name}.{key}: is missing')
        for key in ZERO[kind]:
            path = f'actuators.{name}.{key}'
            found.setdefault(path, Constant(path, 0.0, _unit(path, file.input, slides)))
    return found


def _given(file: RobotFile) -> Iterator[tuple[str, Quantity]]:
    yield 'gravity', file.gravity
    parts = {
        f'{group}.{name}': part
        for group in ('actuators', 'links', 'joints', 'sensors')
        for name, part in getattr(file, group).items()
    }
    parts |= {} if file.ground is None else {'ground': file.ground}
    for path, part in parts.items():
        yield from ((f'{path}.{key}', q) for key, q in part if isinstance(q, Quantity))


def checked(where: str, path: str, quantity: Quantity, unit: str) -> Constant:
    """A constant as a file gives it; `where` is the file and the place in it, for the error.

    UserError: another unit, a value outside its uncertain range, or one of these outside what any
    robot has.
    """
    if not _same(path, quantity.unit, unit):
        raise UserError(f'{where}: {path}: the unit is {unit!r}, found {quantity.unit!r}')
    low, high = quantity.uncertain or (quantity.value, quantity.value)
    if not low <= quantity.value <= high:
        raise UserError(
            f'{where}: {path}: {quantity.value:g} is outside its uncertain range '
            f'{low:g} to {high:g} {unit}'
        )
    if wrong := outside(path.rsplit('.', 1)[-1], unit, low, high):
        raise UserError(f'{where}: {path}: {wrong}')
    return Constant(path, quantity.value, unit, quantity.uncertain)


def outside(figure: str, unit: str, *values: float) -> str:
    """Which of some values is not in the range of a figure, and that range; '' where all are."""
    low, high = RANGES[figure, unit]
    for value in values:
        if not low <= value <= high:
            return f'{value:g} {unit} is not within {low:g} to {high:g} {unit}'.replace('  ', ' ')
    return ''


def _urdf_constants(links: tuple[Link, ...], joints: tuple[Joint, ...]) -> list[Constant]:
    bodies_of = {link.name: link.body for link in links}
    found = []
    for joint in joints:
        body, path = bodies_of[joint.child], f'links.{joint.child}.'
        figures = (body.mass, *body.com, _about(body, joint.axis))
        found += [
            Constant(path + key, value, unit)
            for (key, unit), value in zip(BODY_UNITS.items(), figures, strict=True)
        ]
        if joint.independent:
            path = f'joints.{joint.name}.damping'
            unit = DAMPING if joint.kind != 'prismatic' else sliding(DAMPING)
            found.append(Constant(path, joint.damping, unit))
    return found


def _unit(path: str, input_kind: str, slides: Set[str]) -> str:
    group, key = path.split('.', 1)[0], path.rsplit('.', 1)[-1]
    name = path.removeprefix(f'{group}.').removesuffix(f'.{key}')
    if group == 'ground':
        return GROUND_UNITS[key]
    if group == 'joints':
        unit = {'damping': DAMPING, 'friction': 'N m'}[key]
    else:
        unit = INPUT_UNITS[input_kind] if key == 'limit' else UNITS[key]
    return sliding(unit) if group in OF_JOINTS and name in slides else unit


def _same(path: str, said: str, unit: str) -> bool:
    """Whether a file may say a unit: that of the constant, or on a slide that of turning.

    Files of before 2026-12 have the latter.
    """
    return said == unit or (path.split('.', 1)[0] in OF_JOINTS and sliding(said) == unit)


def bodies(
    links: tuple[Link, ...], joints: tuple[Joint, ...], values: Mapping[str, Any]
) -> dict[str, Body]:
    result = {}
    axes = {joint.child: joint.axis for joint in joints}
    for link in links:
        body = link.body
        if link.name in axes:
            path = f'links.{link.name}.'
            added = values[path + 'inertia'] - _about(body, axes[link.name])
            xx, yy, zz, *products = body.inertia
            body = Body(
                values[path + 'mass'],
                tuple(values[path + c] for c in COM),
                (xx + added, yy + added, zz + added, *products),
                (values.get(path + 'force_x', 0.0), 0.0, values.get(path + 'force_z', 0.0)),
            )
        result[link.name] = body
    return result


def _about(body: Body, axis: tuple[float, float, float]) -> float:
    """Moment of inertia about the CoM along an axis (x for a fixed joint without one)."""
    x, y, z = axis
    xx, yy, zz, xy, xz, yz = body.inertia
    return x * x * xx + y * y * yy + z * z * zz + 2 * (x * y * xy + x * z * xz + y * z * yz)
