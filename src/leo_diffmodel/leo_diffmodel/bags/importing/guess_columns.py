# SPDX-License-Identifier: Apache-2.0
"""Which columns of a log are which joints', and what a known robot says of them."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from difflib import SequenceMatcher
import re
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Constant, Robot
from leo_sim.drivers.base import INTERFACES

from .guess_roles import plain, Role, role_of
from .guess_units import peak_of, RADIANS, Unit
from .log_format import Column, Table

MEASURED = ('position', 'velocity', 'effort')
DRIVEN_BY = (
    *(('voltage', True), ('effort', True), ('voltage', False)),
    *(('position', True), ('effort', False)),
)
"""Quantities that drive a joint and whether as a goal: of several the first is taken."""
INPUTS = {interface: name for name, interface in INTERFACES.items()}  # as `robot init --input`
WITH_THE_DRIVE = ('enabled', 'supply_voltage', 'current')  # that an input has besides
OF_ALL = ('enabled', 'supply_voltage')  # quantities that all joints share where no joint is named
Roles = Mapping[str, Role]
Columns = dict[str, dict[str, str]]  # columns by joint and quantity
ByQuantity = dict[tuple[str, bool], dict[str, str]]
"""The first column of each joint by quantity and whether it is a goal; one without a joint is of
`joint`."""
SIMILAR = 0.6  # share of letters in one order from which names are one: as difflib has it
OVER_A_STOP = 1.1  # times the angle of a stop that a joint reaches, which gives


class KnownRobot(NamedTuple):
    """What is needed of a robot.

    Its name or folder as the map says it; the joints that move, without those of a planar base;
    lowest and highest positions [rad, m], infinite for none; the quantity that it is driven by.
    """

    ref: str
    joints: tuple[str, ...]
    slides: frozenset[str]
    limits: Mapping[str, tuple[float, float]]
    takes: str
    constants: Mapping[str, Constant] = MappingProxyType({})


def known_robot(robot: Robot, ref: str) -> KnownRobot:
    joints = tuple(name for name in robot.joint_names if name not in robot.base_joints)
    limits = {joint.name: joint.limits for joint in robot.joints}
    return KnownRobot(ref, joints, robot.slides, limits, INTERFACES[robot.input], robot.constants)


def matched(names: Sequence[str], robot: KnownRobot) -> dict[str, tuple[str, str]]:
    """Return (joint of the robot, why) for names in a log that are one of its joints."""
    if len(robot.joints) == 1:
        return dict.fromkeys(names, (robot.joints[0], 'its only joint'))
    found = _by_name(names, robot.joints) or _by_number(names, robot.joints)
    names_left = [name for name in names if name not in found]
    joints_left = [joint for joint in robot.joints if joint not in {j for j, _ in found.values()}]
    if found and len(names_left) == len(joints_left) == 1:
        found[names_left[0]] = joints_left[0], 'the one left over'
    if not found:
        raise UserError(
            f'none of {", ".join(names)} in the log is named like a joint of '
            f'{robot.ref}: {", ".join(robot.joints)}; rename the columns, or guess '
            'without --model and name the joints in the map'
        )
    return found


def _by_name(names: Sequence[str], joints: Sequence[str]) -> dict[str, tuple[str, str]]:
    from scipy.optimize import linear_sum_assignment

    known = [role_of(joint).joint or joint for joint in joints]
    alike = np.array([[_alike(name, joint) for joint in known] for name in names])
    pairs = zip(*linear_sum_assignment(alike, maximize=True), strict=True)
    return {names[i]: (joints[j], 'by its name') for i, j in pairs if alike[i, j] >= SIMILAR}


def _by_number(names: Sequence[str], joints: Sequence[str]) -> dict[str, tuple[str, str]]:
    if len(names) != len(joints) or not all(re.fullmatch(r'joint_?\d+', name) for name in names):
        return {}
    order = sorted(names, key=lambda name: int(re.sub(r'\D', '', name)))
    why = "in the robot's order: look it over"
    return {name: (joint, why) for name, joint in zip(order, joints, strict=True)}


def _alike(name: str, joint: str) -> float:
    first, second = (re.sub(r'[\W_]', '', plain(text)) for text in (name, joint))
    for mark in (r'\d+', r'left|right|links|rechts'):
        if set(re.findall(mark, first)) != set(re.findall(mark, second)):
            return 0.0
    return SequenceMatcher(None, first, second).ratio()


def of_joint(robot: KnownRobot, joint: str, values: Column) -> Unit | None:
    """Return the unit in which a position is one of the joint; None where none is."""
    low, high = robot.limits.get(joint, (-np.inf, np.inf))
    reach, peak = max(abs(low), abs(high)), peak_of([values])
    if joint in robot.slides:
        return Unit('m', f'{joint} of {robot.ref} slides')
    if not np.isfinite(reach):
        why = f'{joint} of {robot.ref} turns round: unit: rad or deg'
        return Unit('?', why) if peak > RADIANS else None
    if peak <= reach * OVER_A_STOP:
        return Unit('rad', f'within the stops of {robot.ref}, {reach:.3g} rad')
    if np.radians(peak) <= reach * OVER_A_STOP and peak > RADIANS:
        why = f'within the stops of {robot.ref}, {np.degrees(reach):.0f} deg'
        return Unit('deg', f'{why}; of per cent of a range scale: rad for 1 %')
    return None


def of_per_cent(robot: KnownRobot, joint: str) -> Unit | None:
    low, high = robot.limits.get(joint, (-np.inf, np.inf))
    way = high - low
    why = 'numbers end at exactly 100: per cent of the calibrated range; from stop to stop of '
    why += f'{robot.ref} scale: {way / 200:.4g} for -100 to 100, {way / 100:.4g} for 0 to 100'
    return Unit('?', why) if np.isfinite(way) else None


class Chosen(NamedTuple):
    """Columns of the map, no time ('') where none rises; notes on how names became joints."""

    time: str
    joints: Columns
    inputs: Columns
    notes: tuple[str, ...]

    @property
    def used(self) -> set[str]:
        parts = (*self.joints.values(), *self.inputs.values())
        return {self.time, *(column for columns in parts for column in columns.values())}


def choose(first: Table, roles: Roles, robot: KnownRobot | None) -> Chosen:
    notes: tuple[str, ...] = ()
    positions = _by_quantity(roles)['position', False]
    if robot and positions:
        every = {role.joint or 'joint' for role in roles.values() if role.quantity}
        pairs = matched(sorted(every) if len(robot.joints) == 1 else list(positions), robot)
        notes = tuple(_notes({name: pairs[name] for name in positions if name in pairs}, robot))
        roles = _renamed(roles, {name: joint for name, (joint, _) in pairs.items()})
    found = _by_quantity(roles)
    joints: Columns = {joint: {} for joint in found['position', False]}
    for quantity in MEASURED:
        for joint, column in found[quantity, False].items():
            if joint in joints:
                joints[joint][quantity] = column
    driven = {joint: _driving(found, joint, robot) for joint in joints}
    inputs = {joint: columns for joint, columns in driven.items() if columns}
    return Chosen(rising(first, roles), joints, inputs, notes)


def rising(table: Table, roles: Roles) -> str:
    """Return the first column that is named as a time and never falls; '' without one."""
    named = (name for name, role in roles.items() if role.quantity == 'time')
    known = {name: table[name][np.isfinite(table[name])] for name in named}
    return next((name for name, t in known.items() if (np.diff(t) >= 0).all()), '')


def _notes(pairs: Mapping[str, tuple[str, str]], robot: KnownRobot) -> Iterable[str]:
    for name, (joint, why) in pairs.items():
        if name != joint:
            yield f'{name} in the log is {joint} of {robot.ref}: {why}'
    missing = [joint for joint in robot.joints if joint not in {j for j, _ in pairs.values()}]
    if missing:
        yield f'no column is a position of {", ".join(missing)}'


def _renamed(roles: Roles, names: Mapping[str, str]) -> Roles:
    """Return the roles with the robot's joints; columns of none of them have no part."""
    renamed = dict(roles)
    for column, role in roles.items():
        if role.quantity != 'time' and (role.joint or role.quantity not in OF_ALL):
            joint = names.get(role.joint or 'joint', '')
            renamed[column] = role._replace(joint=joint, quantity=role.quantity if joint else '')
    return renamed


def _driving(found: ByQuantity, joint: str, robot: KnownRobot | None) -> dict[str, str]:
    takes = robot.takes if robot else ''
    ways = sorted(DRIVEN_BY, key=lambda way: way[0] != takes)
    driven = next((way for way in ways if joint in found[way]), None)
    if driven is None:
        return {}
    columns = {driven[0]: found[driven][joint]}
    for name in WITH_THE_DRIVE:
        logged = found[name, False]
        shared = logged.get('joint') if name in OF_ALL else None
        if column := logged.get(joint) or shared:
            columns[name] = column
    return columns


def _by_quantity(roles: Roles) -> ByQuantity:
    found: ByQuantity = defaultdict(dict)
    for name, role in roles.items():
        found[role.quantity, role.is_goal].setdefault(role.joint or 'joint', name)
    return found
