# SPDX-License-Identifier: Apache-2.0
"""Whether robot.yaml and robot.urdf of a folder belong together; one line says where not."""

from collections.abc import Iterable, Iterator, Sequence, Set
from pathlib import Path
from typing import get_args

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_sim.common.yaml_file import Quantity, Schema
from leo_sim.description.constants import BUS_UNITS, checked, SERVO_UNITS, TORQUE_LOOP
from leo_sim.description.robot_file import BusFile, OfStep, RobotFile
from leo_sim.description.urdf import Joint, Link

OF_FEET = ('ankle_forward', 'height_over_feet')
PLANAR = ('prismatic', 'prismatic', 'turning')


def check(folder: Path, file: RobotFile, links: Sequence[Link], joints: Sequence[Joint]) -> None:
    path = folder / 'robot.yaml'
    for wrong in _wrong(file, links, joints):
        raise UserError(f'{path}: {wrong}')
    if file.driver.bus is not None:
        _check_servos(path, file, file.driver.bus, _moving(joints))
    heavy = {link.name for link in links if link.body.mass}
    heavy |= {name for name, link in file.links.items() if link.mass is not None}
    if wrong := weightless(joints, heavy):
        raise UserError(
            f'{folder / "robot.urdf"}: {wrong}; give it an <inertial>, or a mass under links in '
            'robot.yaml'
        )


def _moving(joints: Sequence[Joint]) -> list[str]:
    return [joint.name for joint in joints if joint.independent]


def _wrong(file: RobotFile, links: Sequence[Link], joints: Sequence[Joint]) -> Iterator[str]:
    """Where the two do not fit; what comes later holds only where all before it is right."""
    yield from _copies(file, joints)
    for name in (name for name, joint in file.joints.items() if name in joint.turns_with):
        yield f'joints.{name}.turns_with: it turns with its own motor; take {name!r} out'
    yield from _unknown(_named_joints(file), _moving(joints), 'moving joint')
    yield from _unknown(_named_links(file), [link.name for link in links], 'link')
    if 'nominal' not in file.start_poses:
        yield 'start_poses: the pose nominal is missing'
    yield from _base(file, joints)
    yield from _task(file)
    yield from _loops(file)
    yield from _ground(file, joints)
    if file.driver.dynamixel and file.driver.feetech:
        yield 'driver: dynamixel and feetech are both given; give one of them'


def _named_joints(file: RobotFile) -> Iterable[tuple[str, str]]:
    for group in ('actuators', 'joints', 'sensors'):
        yield from ((group, name) for name in getattr(file, group))
    for name, joint in file.joints.items():
        yield from ((f'joints.{name}.turns_with', other) for other in joint.turns_with)
    if (bus := file.driver.bus) is not None:
        yield from ((f'driver.{file.driver.family}.servos', name) for name in bus.servos)
    for name, pose in file.start_poses.items():
        yield from ((f'start_poses.{name}', joint) for joint in (*pose.angles, *pose.rates))
    for group in ('observation', 'reward', 'termination'):
        yield from ((group, term.joint) for term in getattr(file, group) if term.joint)


def _copies(file: RobotFile, joints: Sequence[Joint]) -> Iterator[str]:
    leaders = {joint.name: joint.leader for joint in joints if joint.leader}
    for key, name in _named_joints(file):
        if name in leaders:
            yield f'{key}: {name!r} mimics {leaders[name]!r} and moves with it; take it out here'


def _named_links(file: RobotFile) -> Iterable[tuple[str, str]]:
    yield from (('links', name) for name in file.links)
    yield from ((f'contacts.{name}', contact.link) for name, contact in file.contacts.items())
    yield from (('feet', name) for name in file.feet)


def _unknown(named: Iterable[tuple[str, str]], known: list[str], what: str) -> Iterator[str]:
    for key, name in named:
        if name not in known:
            yield f'{key}: robot.urdf has no {what} {name!r}{nearest(name, known)}'


def weightless(joints: Sequence[Joint], heavy: Set[str]) -> str:
    """A link behind a moving joint that weighs nothing, nor what is fixed to it; '' for none."""
    weighs = {*heavy}
    for joint in reversed(joints):
        if joint.kind == 'fixed' and joint.child in weighs:
            weighs.add(joint.parent)
    for joint in joints:
        if joint.independent and joint.child not in weighs:
            return f'link {joint.child!r}, which joint {joint.name!r} moves, has no mass'
    return ''


def _base(file: RobotFile, joints: Sequence[Joint]) -> Iterator[str]:
    """A planar base is slides along x and z and a hinge, first and without motors."""
    base = [joint for joint in joints if joint.independent][:3]
    kinds = tuple('prismatic' if j.kind == 'prismatic' else 'turning' for j in base)
    wrong = kinds != PLANAR or any(j.name in file.actuators for j in base)
    if file.base == 'planar' and wrong:
        yield (
            'base: planar needs a slide along x, a slide along z and a hinge without motors as '
            'the first joints of robot.urdf'
        )


def _task(file: RobotFile) -> Iterator[str]:
    for term in file.reward:
        if term.quantity not in get_args(OfStep) and term.joint is None:
            yield f'reward: {term.quantity} needs a joint'
        if term.quantity == 'motor_power' and file.input != 'voltage':
            yield 'reward: motor_power needs input: voltage'
        if term.quantity == 'input' and term.joint not in file.actuators:
            yield f'reward: input: {term.joint!r} has no actuator'
    quantities: set[str] = {term.quantity for term in file.reward}
    quantities |= {rule.quantity for rule in file.termination}
    if quantities & {*OF_FEET} and not file.feet:
        yield f'feet: {" and ".join(OF_FEET)} need the links that are feet'


def _loops(file: RobotFile) -> Iterator[str]:
    stiff = [name for name, a in file.actuators.items() if a.stiffness]
    moved = [name for name, a in file.actuators.items() if a.torque_constant or not a.stiffness]
    if stiff and moved:
        yield (
            f'actuators: {stiff[0]} has a stiffness, and {moved[0]} a motor or none; give all of '
            'them stiffness and effort, or all of them a motor and position_gain'
        )
    if stiff and file.driver and file.driver.bus:
        yield (
            f'driver: the servos of a bus need a motor and position_gain, and {stiff[0]} has '
            'a stiffness'
        )
    for name, actuator in file.actuators.items():
        for key in (*SERVO_UNITS, *TORQUE_LOOP):
            if getattr(actuator, key) is not None and file.input != 'position':
                yield (
                    f'actuators.{name}.{key}: is of a servo that takes positions; with input: '
                    f'{file.input} there is none'
                )


def _ground(file: RobotFile, joints: Sequence[Joint]) -> Iterator[str]:
    if file.contacts and file.ground is None:
        yield 'ground: contacts need it'
    if file.contacts and (copies := [joint.name for joint in joints if joint.leader]):
        yield (
            f'contacts: {copies[0]!r} mimics another joint, which no robot on the ground has; '
            'make it fixed in robot.urdf'
        )
    touching = {contact.link for contact in file.contacts.values()}
    for name in file.feet:
        if name not in touching:
            yield f'feet: no contact belongs to {name!r}'
    if any(t.quantity == 'ankle_forward' for t in file.reward) and len(file.feet) != 2:
        yield 'feet: ankle_forward needs two'
    for name, pose in file.start_poses.items():
        if pose.on_ground and not (file.contacts and file.base == 'planar'):
            yield f'start_poses.{name}: on_ground needs base: planar and contacts'


def _check_servos(path: Path, file: RobotFile, bus: BusFile, moving: list[str]) -> None:
    where = f'{path}: driver.{file.driver.family}.servos'
    _check_figures(f'{path}: driver.{file.driver.family}', bus)
    for joint in moving:
        if joint not in bus.servos:
            raise UserError(
                f'{where}: {joint} has none; every joint needs one, or an encoder of '
                'the same kind, for a state to be whole'
            )
    ids = [servo.id for servo in bus.servos.values()]
    for joint, servo in bus.servos.items():
        if ids.count(servo.id) > 1:
            raise UserError(f'{where}.{joint}: id {servo.id} is given twice')
        _check_figures(f'{where}.{joint}', servo)
        if servo.low >= servo.high:
            raise UserError(f'{where}.{joint}: low is not below high')
        if file.input == 'torque' and joint in file.actuators and servo.torque_constant is None:
            raise UserError(
                f'{where}.{joint}: torque_constant is missing; torque is asked for as current'
            )


def _check_figures(where: str, part: Schema) -> None:
    for key, figure in part:
        if isinstance(figure, Quantity):
            checked(where, key, figure, BUS_UNITS[key])
