# SPDX-License-Identifier: Apache-2.0
"""`leo import LOG --guess`: a column map with what was guessed, and why, to be looked over.

Names of columns say what they are, numbers say the unit, and a robot both; what none of them says
is left as '?', which an import refuses.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.yaml_file import shown
from leo_sim.description.robot import Robot

from .calibration import ARM, calibration_beside
from .guess_columns import choose, Columns, INPUTS, known_robot, KnownRobot
from .guess_each import Units
from .guess_roles import as_taken, roles_of, with_flags
from .join import are_parts, joined
from .lerobot import is_lerobot, read_info
from .log_format import LogFormat, Table
from .tables import read_tables, reader_of

MOST_NAMED = 40


def guess_map(
    logs: Path | Sequence[Path],
    file: Path,
    robot: Robot | None = None,
    ref: str = '',
    join: bool = False,
) -> Path:
    """Write a column map for a log, or for several that are parts of one run; return its path.

    Args:
        logs: the first is looked at, and the others with it where they are parts.
        file: to write; one that is there already is refused.
        robot: that was logged, where it is known.
        ref: its name or folder, for the map.
        join: the logs are parts of one run; by default where their names say so.
    """
    if file.exists():
        raise UserError(f'{file} is there already; name another one (-o MAP.yaml)')
    paths = [logs] if isinstance(logs, Path) else list(logs)
    log_format = reader_of(paths[0], LogFormat()).guessed(paths[0])
    tables, notes = _read(paths, log_format, join)
    with np.errstate(all='ignore'):
        known = known_robot(robot, ref or robot.name) if robot else None
        lines = list(_lines(paths[0], log_format, tables, known, notes))
    return write_whole(file, '\n'.join([*lines, '']))


def _read(
    paths: Sequence[Path], log_format: LogFormat, join: bool
) -> tuple[list[Table], list[str]]:
    read = [(log, read_tables(log, log_format)) for log in paths]
    notes = reader_of(paths[0], log_format).notes(paths[0])
    if len(paths) > 1 and (join or are_parts(paths, [tables[0] for _, tables in read])):
        tables, how = joined(read)
        return tables, [how, *notes]
    return read[0][1], notes


def _lines(
    log: Path,
    log_format: LogFormat,
    tables: Sequence[Table],
    robot: KnownRobot | None,
    notes: Sequence[str],
) -> Iterator[str]:
    names = [name for name in tables[0] if all(name in each for each in tables)]
    table = {name: np.concatenate([each[name] for each in tables]) for name in names}
    roles = with_flags(roles_of(n for n in table if np.isfinite(table[n]).any()), table)
    roles = as_taken(roles, robot.takes if robot else 'position')
    chosen = choose(tables[0], roles, robot)
    if not chosen.joints:
        raise UserError(_no_position(log, table))
    kind = read_info(log).robot_type if is_lerobot(log) else None
    measured = [role.joint for role in roles.values() if role.quantity == 'position']
    calibration = calibration_beside(log, measured) if ARM.fullmatch(kind or '') else None
    units = Units(tables[0], table, roles, chosen, robot, calibration, is_lerobot(log))
    yield f'# guessed from {shown(log.name)} by leo import --guess: look over every line;'
    yield "# a unit '?' is to be filled in, and joints get the names that your model has for them"
    yield from map(_note, (*notes, *chosen.notes))
    said = f'; info.json says {shown(kind)}' if kind else ''
    yield f'robot: {_text(robot.ref)}' if robot else f'# robot: NAME  # of the model{said}'
    if log_format.records:
        yield _entry('records', log_format.records, 'the first list of rows')
    if chosen.time:
        yield _entry('time', {'column': chosen.time, 'unit': units.time.name}, units.time.why)
    else:
        yield 'time: {period: null}  # no column is named as a time and rises: fill in seconds'
    yield from _part('joints', chosen.joints, units)
    yield from _other_input(chosen.inputs, robot)
    yield from _part('inputs', chosen.inputs, units)
    unused = _named(name for name in table if name not in chosen.used)
    yield f'# not used: {unused or "nothing"}'


def _no_position(log: Path, table: Table) -> str:
    if any(name.isdecimal() or name.endswith(']') for name in table):
        return (
            f'{log}: columns have numbers and no names: {_named(table)}. Write the map by '
            "hand with header: [time, angle, ...], or with position: 2 or 'data[:, 2]'"
        )
    return (
        f'{log}: no column is named as a position is; there are {_named(table)}. Write the '
        'map by hand: leo import --help shows one'
    )


def _part(name: str, joints: Columns, units: Units) -> Iterator[str]:
    if not joints:
        yield f'# no {name}: no column is named as a command is, so the log counts as passive'
        return
    yield f'{name}:'
    for joint, columns in joints.items():
        yield f'  {_text(joint)}:'
        for quantity, column in columns.items():
            unit, values = units.of(joint, quantity, column), units.table[column]
            low, high = np.nanmin(values), np.nanmax(values)
            value = {'column': column, **unit.entry} if unit.entry else column
            yield '    ' + _entry(quantity, value, f'{low:.4g} to {high:.4g}; {unit.why}')


def _other_input(inputs: Columns, robot: KnownRobot | None) -> Iterator[str]:
    found = sorted({quantity for columns in inputs.values() for quantity in list(columns)[:1]})
    if robot and found and robot.takes not in found:
        log = '/'.join(INPUTS[quantity] for quantity in found)
        command = leo('robot', 'init', '--input', log)
        yield _note(
            f'{robot.ref} takes {INPUTS[robot.takes]}, the log has {log}: make the robot '
            f'with {command}'
        )


def _note(text: str) -> str:
    return f'# {" ".join(text.split())}'


def _entry(key: str, value: Any, why: str = '') -> str:
    text = f'{key}: {_text(value)}'
    return f'{text}  {_note(why)}' if why else text


def _text(value: Any) -> str:
    dumped = yaml.safe_dump(
        value, default_flow_style=True, sort_keys=False, width=10**9, allow_unicode=True
    )
    return dumped.removesuffix('...\n').strip()


def _named(names: Iterable[str]) -> str:
    listed = [shown(name) for name in names]
    more = len(listed) - MOST_NAMED
    return ', '.join(listed[:MOST_NAMED]) + (f' and {more} more' if more > 0 else '')
