# SPDX-License-Identifier: Apache-2.0
"""Which column is the time, what each joint measures, and what drives it: a guess by the names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from .expression import Table
from .guess_robot import KnownRobot, matched
from .guess_roles import Role

MEASURED = ('position', 'velocity', 'effort')
DRIVEN_BY = (
    ('voltage', True),
    ('effort', True),
    ('voltage', False),
    ('position', True),
    ('effort', False),
)
"""Quantities that drive a joint and whether as a goal: of several the first is taken."""
WITH_THE_DRIVE = ('supply_voltage', 'current')
"""Quantities of the motor that an input has besides."""
Roles = Mapping[str, Role]
Columns = dict[str, dict[str, str]]
"""Columns by joint and quantity."""


@dataclass(frozen=True)
class Chosen:
    """Columns with a part in the map.

    Attributes:
        time: '' where none is named as a time and rises.
        joints: columns that were measured.
        inputs: columns that drive the joints.
        notes: how names became the robot's joints.
    """

    time: str
    joints: Columns
    inputs: Columns
    notes: tuple[str, ...]

    @property
    def used(self) -> set[str]:
        """The columns that stand in the map."""
        parts = (*self.joints.values(), *self.inputs.values())
        return {self.time, *(column for columns in parts for column in columns.values())}


def choose(first: Table, roles: Roles, robot: KnownRobot | None) -> Chosen:
    """Return the columns that say something, for the joints of a robot where it is known.

    Raises:
        UserError: a robot is known, and no position is one of its joints'.
    """
    notes: tuple[str, ...] = ()
    positions = _of(roles, 'position', goal=False)
    if robot and positions:
        every = {role.joint or 'joint' for role in roles.values() if role.quantity}
        pairs = matched(sorted(every) if len(robot.joints) == 1 else list(positions), robot)
        notes = tuple(_notes({name: pairs[name] for name in positions if name in pairs}, robot))
        roles = _renamed(roles, {name: joint for name, (joint, _) in pairs.items()})
    joints = _joints(roles)
    inputs = {joint: found for joint in joints if (found := _driving(roles, joint, robot))}
    return Chosen(rising(first, roles), joints, inputs, notes)


def rising(table: Table, roles: Roles) -> str:
    """Return the first column that is named as a time and never falls; '' without one."""
    named = (name for name, role in roles.items() if role.quantity == 'time')
    return next((name for name in named if (np.diff(table[name]) >= 0).all()), '')


def _notes(pairs: Mapping[str, tuple[str, str]], robot: KnownRobot) -> Iterable[str]:
    for name, (joint, why) in pairs.items():
        if name != joint:
            yield f'{name} in the log is {joint} of {robot.ref}: {why}'
    missing = [joint for joint in robot.joints if joint not in {j for j, _ in pairs.values()}]
    if missing:
        yield f'no column is a position of {", ".join(missing)}'


def _renamed(roles: Roles, names: Mapping[str, str]) -> Roles:
    """Return the roles with the robot's joints; columns of none of them have no part."""
    return {
        column: role
        if role.quantity == 'time'
        else role._replace(
            joint=names.get(role.joint or 'joint', ''),
            quantity=role.quantity if (role.joint or 'joint') in names else '',
        )
        for column, role in roles.items()
    }


def _joints(roles: Roles) -> Columns:
    """Return the columns that were measured; joints have a position."""
    found = {quantity: _of(roles, quantity, goal=False) for quantity in MEASURED}
    return {
        joint: {
            quantity: found[quantity][joint] for quantity in MEASURED if joint in found[quantity]
        }
        for joint in found['position']
    }


def _driving(roles: Roles, joint: str, robot: KnownRobot | None) -> dict[str, str]:
    """Return the columns of what drives a joint: first what its robot takes."""
    takes = robot.takes if robot else ''
    for quantity, goal in sorted(DRIVEN_BY, key=lambda each: each[0] != takes):
        column = _of(roles, quantity, goal).get(joint)
        if column is not None:
            beside = {name: _of(roles, name, goal=False).get(joint) for name in WITH_THE_DRIVE}
            return {quantity: column} | {name: c for name, c in beside.items() if c}
    return {}


def _of(roles: Roles, quantity: str, goal: bool) -> dict[str, str]:
    """Return the first column of a quantity for each joint; a joint without a name is `joint`."""
    found: dict[str, str] = {}
    for name, role in roles.items():
        if (role.quantity, role.is_goal) == (quantity, goal):
            found.setdefault(role.joint or 'joint', name)
    return found
