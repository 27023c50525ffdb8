# SPDX-License-Identifier: Apache-2.0
"""A robot: its tree, actuators, timing, task, and every constant a model may override."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import entry_points
import os
from pathlib import Path
from typing import Self

import numpy as np
from pydantic import ConfigDict

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import look_up, nearest
from leo_sim.common.yaml_file import read, read_text
from leo_sim.description import robot_file, urdf
from leo_sim.description.constants import Constant, constants_of, INPUT_UNITS, MOTOR_UNITS
from leo_sim.description.coupled import with_coupled
from leo_sim.description.robot_check import check
from leo_sim.description.urdf import Joint, Link

__all__ = ['Actuator', 'Constant', 'Robot', 'load_robot', 'named_robots']
AS_WRITTEN = (
    'name input base control_period integration_step state_rate episode_seconds start_poses '
    'sensors feet observation reward driver'
)
"""What a robot takes over from robot.yaml as it is."""


@dataclass(frozen=True)
class Actuator:
    """An actuator, all figures at the joint side of its gear; None when torque driven."""

    joint: str
    torque_constant: float | None  # N m/A = V s/rad
    resistance: float | None  # ohm
    limit: float  # largest command, V, N m or rad
    supply: float | None  # V; of a servo whose gains are in N m/rad its largest torque, N m
    rotor_inertia: float  # kg m2, on top of the links' inertia

    @property
    def strongest(self) -> float:
        """The most that it can put on the motor: the supply V, or the torque limit N m."""
        return self.limit if self.supply is None else self.supply

    @property
    def stall(self) -> float:
        """Its largest torque at rest [N m]: of a motor on a voltage that of its supply."""
        if self.supply is None or self.torque_constant is None or not self.resistance:
            return self.strongest
        return self.supply * (self.torque_constant / self.resistance)


class Contact(robot_file.ContactFile):
    """A sphere that touches the ground, as `left_heel`; figures it lacks are the ground's."""

    model_config = ConfigDict(frozen=True)

    name: str


@dataclass(frozen=True)
class Robot:
    """A robot as loaded from a folder with robot.urdf and robot.yaml.

    Its observation, reward and termination are the task, see leo_sim.task.task.
    """

    name: str
    folder: Path
    urdf: str  # text of robot.urdf (its inertial figures without those of robot.yaml)
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]  # the tree of the URDF; fixed joints included
    joint_names: tuple[str, ...]  # joints that move, in the order of every state vector
    actuators: tuple[Actuator, ...]  # in the order of every input vector
    input: str  # 'voltage' (V), 'torque' (N m) or 'position' (rad, the goal of a servo's own loop)
    base: str  # 'fixed' or 'planar'
    control_period: float  # s
    integration_step: float  # s, that of the scheme 'reference'
    # how it is integrated: 'reference', 'training', 'search'
    schemes: Mapping[str, robot_file.SchemeFile]
    state_rate: float  # Hz
    episode_seconds: float  # s
    start_poses: Mapping[str, robot_file.PoseFile]
    sensors: Mapping[str, robot_file.SensorFile]
    contacts: tuple[Contact, ...]  # what may touch the ground; empty for robots without ground
    feet: tuple[str, ...]  # links whose contacts are the feet, the origin of a foot its ankle
    observation: tuple[robot_file.ObservedFile, ...]
    reward: tuple[robot_file.RewardFile, ...]
    termination: tuple[robot_file.TerminationFile, ...]
    constants: Mapping[str, Constant]  # every number a model may override, by path
    driver: robot_file.DriverFile  # how its hardware is connected

    @property
    def moving_links(self) -> tuple[str, ...]:
        """Links with a joint between them and the base; not those that only place a joint."""
        empty = {link.name for link in self.links if not link.body.mass}
        placing = {*self.base_joints[:2], *self.copies}
        return tuple(j.child for j in self.joints if j.name not in placing or j.child not in empty)

    @property
    def base_joints(self) -> tuple[str, ...]:
        return self.joint_names[:3] if self.base == 'planar' else ()

    @cached_property
    def copies(self) -> tuple[str, ...]:
        return tuple(joint.name for joint in self.joints if joint.leader)

    @cached_property
    def slides(self) -> frozenset[str]:
        return frozenset(joint.name for joint in self.joints if joint.kind == 'prismatic')

    @cached_property
    def turned_about(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """By link, at angles 0 in the world: frame (3, 3), axes (H, 3) of hinges that turn it."""
        found: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for joint in self.joints:
            frame, axes = found.get(joint.parent, (np.eye(3), np.zeros((0, 3))))
            frame = frame @ np.reshape(joint.rotation, (3, 3))
            if joint.kind in ('revolute', 'continuous'):
                axes = np.vstack([axes, frame @ joint.axis])
            found[joint.child] = frame, axes
        return found

    @property
    def actuated(self) -> tuple[int, ...]:
        return tuple(self.joint_names.index(a.joint) for a in self.actuators)

    @property
    def limits(self) -> np.ndarray:
        return np.array([a.limit for a in self.actuators])

    @property
    def bounds(self) -> np.ndarray:
        """Lowest and highest command of each actuator, (2, A); goals stay within the stops."""
        bounds = np.stack([-self.limits, self.limits])
        if self.input != 'position':
            return bounds
        return np.clip(bounds, *self.stops[list(self.actuated)].T)

    @property
    def stops(self) -> np.ndarray:
        """Lowest and highest angle of each moving joint rad (m), infinite without, (J, 2)."""
        return np.array([joint.limits for joint in self.joints if joint.independent])

    @property
    def input_noise(self) -> np.ndarray:
        """Noise of one measured input of each actuator, see `SensorFile`, (A,)."""
        named = (self.sensors.get(a.joint) for a in self.actuators)
        return np.array([sensor.input_noise if sensor else 0.0 for sensor in named])

    @property
    def input_unit(self) -> str:
        return INPUT_UNITS[self.input]

    @property
    def has_motor_law(self) -> bool:
        """Whether its motors are DC motors on a voltage, of a command or of a servo's own loop."""
        known = all(a.torque_constant is not None for a in self.actuators)
        return self.input == 'voltage' or (self.input == 'position' and known)

    def start_pose(self, name: str) -> robot_file.PoseFile:
        return look_up(name, self.start_poses, f'{self.name} has no start pose')

    def with_constants(self, changed: Mapping[str, Constant]) -> Self:
        constants = {**self.constants, **changed}
        values = {path: c.value for path, c in constants.items()}
        actuators = tuple(_actuator(a.joint, values) for a in self.actuators)
        return replace(self, constants=constants, actuators=actuators)


def load_robot(ref: str | Path) -> Robot:
    """A robot by name (entry point group leo.robots) or by folder.

    UserError: no such robot (naming the nearest one), or a wrong file in its folder.
    """
    folder = Path(ref)
    if not os.path.isdir(folder):  # False for a name that no file can have, too
        name, robots = str(ref), named_robots()
        if name not in robots:
            hint = nearest(name, robots)
            raise UserError(f'no robot is named {name!r}, and it is no folder{hint}')
        folder = robots[name]
    if not (folder / 'robot.yaml').is_file():
        raise UserError(
            f'{folder} is no robot folder (it has no robot.yaml); '
            'give a model file, a robot name or a robot folder'
        )
    file = read(folder / 'robot.yaml', robot_file.RobotFile)
    path = folder / 'robot.urdf'
    if not path.is_file():
        raise UserError(f'{folder} has no robot.urdf')
    return _robot(folder, file, read_text(path))


def named_robots() -> dict[str, Path]:
    return {entry.name: Path(entry.load()) for entry in entry_points(group='leo.robots')}


class OtherRobot(UserError):
    """What runs is another robot than the one that is meant."""


def refuse_other(said: str, robot: Robot) -> None:
    """Raise OtherRobot where what runs says, as its parameter `robot`, that it is another robot.

    It need not say anything (''), and may be of a folder that is not on this machine.
    """
    try:
        name = load_robot(said).name if said else robot.name
    except UserError:
        return
    if name != robot.name:
        raise OtherRobot(
            f'the running robot is {name!r}, this is for {robot.name!r}; start that one, '
            f'or give what was made for {name!r}'
        )


def typed(name: str) -> str:
    """A robot's name as a command takes it; MODEL for one that has no entry point."""
    return name if name in named_robots() else 'MODEL'


def _robot(folder: Path, file: robot_file.RobotFile, text: str) -> Robot:
    source = str(folder / 'robot.urdf')
    text = with_coupled(text, {n: j.turns_with for n, j in file.joints.items()}, source)
    links, joints = urdf.parse(text, source)
    moving = tuple(joint.name for joint in joints if joint.independent)
    check(folder, file, links, joints)
    constants = constants_of(folder, file, links, joints)
    values = {path: constant.value for path, constant in constants.items()}
    return Robot(
        **{name: getattr(file, name) for name in AS_WRITTEN.split()},
        folder=folder,
        urdf=text,
        links=links,
        joints=joints,
        joint_names=moving,
        actuators=tuple(_actuator(joint, values) for joint in file.actuators),
        schemes=_schemes(file),
        contacts=tuple(Contact(name=n, **c.model_dump()) for n, c in file.contacts.items()),
        termination=tuple(rule for rule in file.termination if rule.active),
        constants=constants,
    )


def _schemes(file: robot_file.RobotFile) -> dict[str, robot_file.SchemeFile]:
    step, every = file.integration_step, file.geometry_every
    reference = robot_file.SchemeFile(integration_step=step, geometry_every=every)
    return {
        'reference': reference,
        'training': file.training or reference,
        'search': file.search or file.training or reference,
    }


def _actuator(joint: str, values: Mapping[str, float]) -> Actuator:
    path = f'actuators.{joint}.'
    constant, resistance, supply = (values.get(path + key) for key in MOTOR_UNITS)
    supply = values.get(path + 'effort', supply)
    limit, inertia = values[path + 'limit'], values[path + 'rotor_inertia']
    return Actuator(joint, constant, resistance, limit, supply, inertia)
