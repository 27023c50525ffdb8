# SPDX-License-Identifier: Apache-2.0
"""A URDF or MJCF becomes a robot folder that loads at once."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
import math
from pathlib import Path
import shutil
import tempfile

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_sim.common.yaml_file import read_text
from leo_sim.description import urdf
from leo_sim.description.robot import load_robot, Robot
from leo_sim.description.robot_check import weightless
from leo_sim.description.servos import Family
from leo_sim.description.urdf import BOUNDED, Joint, Link
from leo_sim.verbs.skeleton import figures, robot_yaml
from leo_sim.verbs.skeleton.description import Description, read_urdf, without
from leo_sim.verbs.skeleton.mjcf import read_mjcf
from leo_sim.verbs.skeleton.robot_yaml import actuators, Figures

PERIOD = 0.01


@dataclass(frozen=True)
class Skeleton:
    robot: Robot
    open: tuple[str, ...]
    notes: tuple[str, ...]
    doubts: tuple[str, ...] = ()


def read_description(path: Path) -> Description:
    text = read_text(path)
    root = urdf.root_of(text, str(path))
    if root.tag == 'mujoco':
        return read_mjcf(path, root.get('model', path.stem))
    return read_urdf(path, text, root)


def make_folder(
    source: Path,
    folder: Path,
    kind: str,
    servos: Family | None = None,
    left_out: Sequence[str] = (),
) -> Skeleton:
    """Write robot.urdf and robot.yaml; UserError, and nothing written, where something is wrong.

    From a URDF or MJCF, to a folder that is new, or empty. The actuators take a `kind`: 'torque'
    (N m), 'voltage' (V) or 'position' (rad); '' is the file's own. A bus of `servos` is there to
    be filled in; links `left_out` are taken out, with everything beyond them.
    """
    _check_free(folder)
    description = read_description(source)
    if left_out:
        description = without(description, left_out, str(source))
    kind = kind or ('position' if description.loops and not servos else 'torque')
    if kind == 'torque' and servos == 'feetech':
        raise UserError('Feetech servos do not take torques; give --input voltage or position')
    links, joints = urdf.parse(description.text, str(source))
    if not any(joint.independent for joint in joints):
        raise UserError(f'{source}: no joint moves; a robot has at least one that does')
    if wrong := weightless(joints, {link.name for link in links if link.body.mass}):
        raise UserError(f'{source}: {wrong}; give it an <inertial>')
    with tempfile.TemporaryDirectory() as temporary:
        draft = Path(temporary) / 'robot'
        robot, left = _drafted(draft, source, kind, description, links, joints)
        if servos:
            with (draft / 'robot.yaml').open('a', encoding='utf-8') as file:
                file.write(robot_yaml.driver_lines(joints, kind, servos))
            tried = leo('check-driver', servos, '--by-hand')
            left.append(f'driver: port, baud and every servo are guesses; {tried} tries them')
        _put(draft, folder)
    robot = load_robot(folder)
    notes = (*description.notes, *_without_stops(robot), *_effects(folder, description, joints))
    if description.loops and kind != 'position':
        notes += ('the loops of the servos left out; --input position takes them over',)
    asked = figures.doubt(robot.links, robot.joints, _loads(robot))
    return Skeleton(robot, (*left, *_unphysical(robot)), notes, (asked,) if asked else ())


def _loads(robot: Robot) -> dict[str, float]:
    return dict(zip(robot.joint_names, figures.gravity_torque(robot).tolist(), strict=True))


def _without_stops(robot: Robot) -> list[str]:
    joints = [j for j in robot.joints if j.independent and j.name not in robot.base_joints]
    free = [j.name for j in joints if j.kind in BOUNDED and not math.isfinite(j.limits[0])]
    return [f'no stops are given for {", ".join(free)}: taken to move without end'] * bool(free)


def _effects(folder: Path, description: Description, joints: Sequence[Joint]) -> list[str]:
    dry = _frictions(description, joints).items()
    found = {('coulomb_friction', j): {'c': float(c)} for j, c in dry} | {**description.effects}
    said = ', '.join(f'{name} at {joint}' for name, joint in found)
    words = chain.from_iterable(
        [f'{name}:{joint}', *(f'{key}={value:g}' for key, value in p.items())]
        for (name, joint), p in found.items()
    )
    return [
        f'{said} left out of robot.urdf: an effect each; '
        f'{leo("add", folder, *words, "-o", "model.yaml")}'
    ] * bool(found)


def _frictions(description: Description, joints: Sequence[Joint]) -> dict[str, str]:
    """Dry friction by joint, as written; that of joints that mimic is felt at their leader."""
    found = dict(description.frictions)
    for joint in joints:
        if joint.leader and joint.name in found:
            own = abs(joint.ratio) * float(found.pop(joint.name))
            found[joint.leader] = f'{float(found.get(joint.leader, 0.0)) + own:g}'
    return found


def _check_free(folder: Path) -> None:
    if folder.is_dir() and any(folder.iterdir()):
        raise UserError(f'{folder} is not empty; a robot is always written to a new folder')
    if folder.exists() and not folder.is_dir():
        raise UserError(f'{folder} is a file; -o takes a new folder')


def _drafted(
    draft: Path,
    source: Path,
    kind: str,
    description: Description,
    links: Sequence[Link],
    joints: tuple[Joint, ...],
) -> tuple[Robot, list[str]]:
    """Write the folder twice: to learn what gravity and the step need, and with that."""
    draft.mkdir()
    (draft / 'robot.urdf').write_text(description.text, encoding='utf-8')
    moving = [joint for joint in joints if joint.independent]
    zero = dict.fromkeys((joint.name for joint in moving), 0.0)
    timing, reason = {'period': PERIOD, 'step': PERIOD, 'rate': 1 / PERIOD}, ''
    mass = next(link.body.mass for link in links if link.name == moving[0].child)
    tail = robot_yaml.pose_lines(joints) + robot_yaml.tail(moving[0], mass)

    def write(motors: dict[str, Figures]) -> Robot:
        text = robot_yaml.head(source, kind, description, timing, reason)
        text += robot_yaml.actuator_lines(motors) + tail
        (draft / 'robot.yaml').write_text(text, encoding='utf-8')
        return load_robot(draft)

    slides = frozenset(j.name for j in moving if j.kind == 'prismatic')
    robot = write(actuators(description, zero, kind, slides))
    figures.check_masses(robot, str(source))
    motors = actuators(description, _loads(robot), kind, slides)
    robot = write(motors)
    timing['step'], error = figures.integration_step(robot)
    reason = f'one control period is off by {100 * error:.1g} % of its change of speed'
    left = _open(description, motors, kind)
    if error >= figures.EXACT:
        left.append(
            'integration_step: a stiff robot, even the shortest step tried is not exact; are '
            'masses and limits right?'
        )
    return write(motors), left


def _open(description: Description, motors: dict[str, Figures], kind: str) -> list[str]:
    left = [f'control_period and state_rate: {PERIOD:g} s and {1 / PERIOD:g} Hz are guesses']
    if description.motors is None:
        left.append('actuators: every joint that moves has one; take out those without a motor')
    in_torque = kind == 'position' and description.loops
    if kind != 'torque' and not in_torque:
        left.append(
            'actuators: supply, limit, torque_constant and resistance of each are '
            'guesses; at the joint side of the gear; uncertain: [low, high] what you '
            'know roughly'
        )
    if kind == 'position' and not in_torque:
        left.append(
            'actuators: position_gain of each is a guess: docs/your_robot.md has that of '
            'some servos; resolution is left out: a count of the encoder, rad'
        )
    guessed = [j for j, f in motors.items() if kind == 'torque' and f['limit'].open]
    if guessed:
        left.append(
            f'actuators: the limit of {", ".join(guessed)} is a guess: the file has no effort'
        )
    if light := [j for j, f in motors.items() if f['rotor_inertia'].open]:
        left.append(
            f'actuators: rotor_inertia of {", ".join(light)} is 0; it is the rotor times the '
            'gear ratio squared; then leo robot step measures integration_step again'
        )
    return [
        *left,
        'start_poses: nominal is a guess',
        'sensors, uncertain masses, and a task for leo learn: optional, see the examples',
    ]


def _unphysical(robot: Robot) -> list[str]:
    try:
        urdf.with_bodies(robot.urdf, {link.name: link.body for link in robot.links})
    except UserError as error:
        return [f'robot.urdf: {error}']
    return []


def _put(draft: Path, folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in ('robot.urdf', 'robot.yaml'):
            shutil.copy(draft / name, folder / name)
    except OSError as error:
        raise UserError(f'cannot write {folder}: {error.strerror}') from error
