# SPDX-License-Identifier: Apache-2.0
"""`leo import LOG --guess`: a column map with what was guessed, and why, to be looked over.

Names of columns say what they are, numbers say the unit; what neither says is left as '?', which
an import refuses.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
import json
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.yaml_file import read_text, shown

from .expression import Column, Table
from .guess_roles import Role, role_of
from .guess_units import is_per_cent, of_angles, of_time, Unit
from .log_format import LogFormat
from .tables import format_of, read_tables

DEEPEST = 5
MOST_NAMED = 40
MEASURED = ('position', 'velocity', 'effort')
DRIVEN_BY = (
    ('voltage', True), ('effort', True), ('voltage', False), ('position', True), ('effort', False),
)
"""Quantities that drive a joint and whether as a goal: of several the first is taken."""
SI = {'velocity': 'rad/s', 'effort': 'N m', 'voltage': 'V'}
ANGULAR = {'deg': 'deg/s'}
Roles = Mapping[str, Role]


def guess_map(log: Path, file: Path) -> Path:
    """Write a column map for a log and return its path.

    Raises:
        UserError: the file is there already, the log does not read, or no column is a position.
    """
    if file.exists():
        raise UserError(f'{file} is there already; name another one (-o MAP.yaml)')
    log_format = _log_format(log)
    tables = read_tables(log, log_format)
    whole = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    with np.errstate(all='ignore'):
        lines = list(_lines(log, log_format, tables[0], whole))
    return write_whole(file, '\n'.join([*lines, '']))


def _log_format(log: Path) -> LogFormat:
    """Return how to read a log: of JSON, where its rows are."""
    if format_of(log, LogFormat()) != 'json':
        return LogFormat()
    try:
        return LogFormat(records=_records(json.loads(read_text(log).removeprefix('\ufeff'))))
    except (ValueError, RecursionError):
        return LogFormat()  # and reading it says what is wrong


def _records(content: Any, place: str = '', deep: int = 0) -> str | None:
    """Return the place of the first list of rows, or of columns; None where there is none."""
    if isinstance(content, list):
        return place if content and all(isinstance(row, dict) for row in content) else None
    if not isinstance(content, dict) or deep > DEEPEST:
        return None
    if any(isinstance(v, list) and v and isinstance(v[0], int | float) for v in content.values()):
        return place
    inside = (_records(v, f'{place}.{key}'.lstrip('.'), deep + 1) for key, v in content.items())
    return next((found for found in inside if found is not None), None)


def _lines(log: Path, log_format: LogFormat, first: Table, table: Table) -> Iterator[str]:
    """Yield the lines of the map, from the first episode and all of them in one table.

    Raises:
        UserError: no column is a position.
    """
    roles = {name: role_of(name) for name in table if np.isfinite(table[name]).any()}
    joints = _joints(roles)
    if not joints:
        raise UserError(f'{log}: no column is named as a position is; there are '
                        f'{_named(table)}. Write the map by hand: leo import --help shows one')
    time = _rising(first, roles)
    driving = {joint: found for joint in joints if (found := _driving(roles, joint))}
    used = {time, *(column for columns in joints.values() for column in columns.values()),
            *(column for _, column in driving.values())}
    yield f'# guessed from {shown(log.name)} by leo import --guess: look over every line;'
    yield "# a unit '?' is to be filled in, and joints get the names that your model has for them"
    yield '# robot: NAME  # of the model'
    if log_format.records:
        yield _entry('records', log_format.records, 'the first list of rows')
    yield _time(time, first, roles)
    yield from _part('joints', {j: list(c.items()) for j, c in joints.items()}, roles, table)
    yield from _part('inputs', {j: [found] for j, found in driving.items()}, roles, table)
    yield f'# not used: {_named(name for name in table if name not in used) or "nothing"}'


def _rising(table: Table, roles: Roles) -> str:
    """Return the first column that is named as a time and never falls; '' without one."""
    named = (name for name, role in roles.items() if role.quantity == 'time')
    return next((name for name in named if (np.diff(table[name]) >= 0).all()), '')


def _time(column: str, table: Table, roles: Roles) -> str:
    if not column:
        return 'time: {period: null}  # no column is named as a time and rises: fill in seconds'
    told = roles[column].unit
    unit = Unit(told, 'its name says so') if told else of_time(table[column])
    return _entry('time', {'column': column, 'unit': unit.name}, unit.why)


def _joints(roles: Roles) -> dict[str, dict[str, str]]:
    """Return the columns that were measured, by joint and quantity; joints have a position."""
    found = {quantity: _of(roles, quantity, goal=False) for quantity in MEASURED}
    return {
        joint: {quantity: found[quantity][joint] for quantity in MEASURED
                if joint in found[quantity]}
        for joint in found['position']
    }


def _part(
    name: str, joints: Mapping[str, Sequence[tuple[str, str]]], roles: Roles, table: Table,
) -> Iterator[str]:
    """Yield `joints:` or `inputs:` with (quantity, column) of each joint."""
    if not joints:
        yield f'# no {name}: no column is named as a command is, so the log counts as passive'
        return
    angle = _angle_unit(table, roles)
    yield f'{name}:'
    for joint, columns in joints.items():
        yield f'  {_text(joint)}:'
        for quantity, column in columns:
            unit = _unit(quantity, roles[column], table[column], angle)
            low, high = np.nanmin(table[column]), np.nanmax(table[column])
            value = {'column': column, 'unit': unit.name}
            yield '    ' + _entry(quantity, value, f'{low:.4g} to {high:.4g}; {unit.why}')


def _driving(roles: Roles, joint: str) -> tuple[str, str] | None:
    """Return (interface, column) of what drives a joint."""
    for quantity, goal in DRIVEN_BY:
        column = _of(roles, quantity, goal).get(joint)
        if column is not None:
            return quantity, column
    return None


def _of(roles: Roles, quantity: str, goal: bool) -> dict[str, str]:
    """Return the first column of a quantity for each joint; a joint without a name is `joint`."""
    found: dict[str, str] = {}
    for name, role in roles.items():
        if (role.quantity, role.is_goal) == (quantity, goal):
            found.setdefault(role.joint or 'joint', name)
    return found


def _angle_unit(table: Table, roles: Roles) -> Unit:
    """Return the unit that all angles without one in their name share."""
    open_ones = (n for n, role in roles.items() if role.quantity == 'position' and not role.unit)
    return of_angles([table[name] for name in open_ones])


def _unit(quantity: str, role: Role, values: Column, angle: Unit) -> Unit:
    if role.unit:
        return Unit(role.unit, 'its name says so')
    if quantity == 'velocity' and angle.name != 'rad':
        return Unit(ANGULAR.get(angle.name, '?'), 'as the angles')
    if quantity != 'position':
        return Unit(SI[quantity], 'nothing says another')
    if 'gripper' in role.joint and angle.name == 'deg' and is_per_cent(values):
        return Unit('?', 'a gripper is often in per cent: then scale: rad for 1 %')
    return angle


def _entry(key: str, value: Any, why: str = '') -> str:
    text = f'{key}: {_text(value)}'
    return f'{text}  # {why}' if why else text


def _text(value: Any) -> str:
    """Return a value as YAML in one line."""
    dumped = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10**9,
                            allow_unicode=True)  # fmt: skip
    return dumped.removesuffix('...\n').strip()


def _named(names: Iterable[str]) -> str:
    """Return names in one line, of many the first."""
    listed = [shown(name) for name in names]
    more = len(listed) - MOST_NAMED
    return ', '.join(listed[:MOST_NAMED]) + (f' and {more} more' if more > 0 else '')
