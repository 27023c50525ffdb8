# SPDX-License-Identifier: Apache-2.0
"""What logs say of the robot they were made with: its payload, a length, a gain."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.resources import files
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.common.yaml_file import read
from leo_sim.description.robot import load_robot

from ..arrays import LONGEST, Run, write_runs
from ..types import APPLIED
from .column_map import ColumnMap, ColumnSpec, QUANTITIES, unit_factor
from .expression import Column, Table
from .tables import episodes_of, tables_of

SAME = 1e-9


def known_constants(tables: Sequence[tuple[Path, Table]], mapping: ColumnMap) -> dict[str, float]:
    """Return the constants of the robot that the logs know, by path and in its units.

    Raises:
        UserError: the robot has no such constant, a log no such column, or the value is not one
            and the same in all rows of all logs.
    """
    assert mapping.robot is not None
    robot, found = load_robot(mapping.robot), {}
    for path, spec in mapping.constants.items():
        if path not in robot.constants:
            raise UserError(
                f'column map: constants: {robot.name} has no {path!r}'
                f'{nearest(path, robot.constants)}'
            )
        unit = robot.constants[path].unit
        found[path] = _one(
            path,
            [(log, _single(path, log, spec.values(t, path, str(log), unit))) for log, t in tables],
        )
    return found


def _single(path: str, log: Path, values: Column) -> float:
    """Return the value in all rows of a log that have one."""
    known = values[np.isfinite(values)]
    if not known.size:
        raise UserError(f'{log} has no number for {path}')
    if np.ptp(known) > SAME * np.abs(known).max():
        raise UserError(
            f'{log}: {path} goes from {known.min():.6g} to {known.max():.6g}; '
            'it must be one value in all rows'
        )
    return float(known[0])


def _one(path: str, values: Sequence[tuple[Path, float]]) -> float:
    """Return the value that all logs of one bag have."""
    first, value = values[0]
    for log, other in values:
        if abs(other - value) > SAME * max(abs(other), abs(value)):
            raise UserError(
                f'{path} is {value:.6g} in {first} and {other:.6g} in {log}; '
                'give each log a bag of its own (--bag-per-log)'
            )
    return value


Rows = NDArray[np.int64]


def import_logs(
    logs: Iterable[str | Path],
    column_map: str | Path | ColumnMap,
    bag: str | Path,
    join: bool = False,
) -> Path:
    """Write logs to one bag, an episode per run in them, and return its folder.

    Args:
        logs: CSV, JSON or MATLAB files, folders of LeRobot data sets.
        column_map: a YAML file, or the name of a shipped map.
        bag: the folder to make.
        join: the logs are parts of one run, as q.csv and dq.csv; by default where their names
            say so.

    Raises:
        UserError: wrong map or log, time going backwards, a constant that the robot does not
            have or that changes, or the folder exists.
    """
    where = str(column_map) if not isinstance(column_map, ColumnMap) else 'column map'
    mapping = load_map(column_map)
    paths = [Path(log) for log in logs]
    tables, told = episodes_of(paths, mapping, join)
    runs = [_run(log, table, mapping) for log, table in tables]
    if not runs:
        raise UserError('no logs to import; name at least one file')
    said = [joint for joint, columns in mapping.joints.items() if columns.position.says_unit]
    metadata = {
        'imported_from': ', '.join(log.name for log in paths),
        'column_map': where,
        'angle_units_said': ', '.join(said),
    }
    if told:
        metadata['joined'] = told
    if mapping.inputs:
        metadata['inputs_from'] = ', '.join(_sources(mapping))
    if mapping.robot:
        metadata['robot'] = mapping.robot
    if mapping.constants:
        metadata['constants'] = json.dumps(known_constants(tables, mapping))
    return write_runs(Path(bag), runs, metadata)


def _sources(mapping: ColumnMap) -> list[str]:
    """Return the columns and expressions that drive the joints, as the map names them."""
    return [
        str(spec.column or spec.expression)
        for interfaces in mapping.inputs.values()
        for name, spec in interfaces.items()
        if name in APPLIED
    ]


def load_map(source: str | Path | ColumnMap) -> ColumnMap:
    """Return a column map from a file or, by its name, one that is shipped.

    Raises:
        UserError: no such map (naming the nearest shipped one) or wrong in it.
    """
    if isinstance(source, ColumnMap):
        return source
    if Path(source).is_file():
        return read(Path(source), ColumnMap)
    shipped = shipped_maps()
    name = str(source).removesuffix('.yaml')
    if name not in shipped:
        raise UserError(f'no column map {source}{nearest(Path(name).name, shipped)}')
    return read(shipped[name], ColumnMap)


def shipped_maps() -> dict[str, Path]:
    """Return the column maps of the public data sets, by name."""
    folder = Path(str(files('leo_diffmodel.bags') / 'maps'))
    return {path.stem: path for path in sorted(folder.glob('*.yaml'))}


def read_runs(log: Path, mapping: ColumnMap) -> list[Run]:
    """Return the runs of one log.

    Raises:
        UserError: columns missing (listing those there are), units wrong, time going backwards.
    """
    return [_run(log, table, mapping) for table in tables_of(log, mapping)]


def _run(log: Path, table: Table, mapping: ColumnMap) -> Run:
    t, rows = _time(log, table, mapping)
    joints = list(mapping.joints)

    def columns(quantity: str) -> list[ColumnSpec | None]:
        return [getattr(mapping.joints[joint], quantity) for joint in joints]

    q = _matrix(log, table, rows, columns('position'), 'position')
    assert q is not None
    return Run(
        t=t,
        joints=joints,
        q=q,
        dq=_matrix(log, table, rows, columns('velocity'), 'velocity'),
        effort=_matrix(log, table, rows, columns('effort'), 'effort'),
        inputs={
            joint: {
                name: spec.values(table, name, str(log))[rows] for name, spec in interfaces.items()
            }
            for joint, interfaces in mapping.inputs.items()
        },
    )


def _matrix(
    log: Path, table: Table, rows: Rows, specs: Sequence[ColumnSpec | None], quantity: str
) -> NDArray[np.float64] | None:
    """Stack one quantity of all joints, NaN for joints without; None where no joint has it."""
    if not any(specs):
        return None
    missing = np.full(len(rows), np.nan)
    return np.column_stack(
        [
            missing if spec is None else spec.values(table, quantity, str(log))[rows]
            for spec in specs
        ]
    )


def _time(log: Path, table: Table, mapping: ColumnMap) -> tuple[Column, Rows]:
    """Return times [s] that increase and the rows they belong to; repeats and NaN are left out.

    Raises:
        UserError: time goes backwards, or fewer than two samples.
    """
    length = len(next(iter(table.values())))
    if mapping.time.period is not None:
        t: Column = np.arange(length, dtype=float) * mapping.time.period
    else:
        spec = ColumnSpec(column=mapping.time.column)
        factor = unit_factor(mapping.time.unit, 'time', str(log), QUANTITIES['time'])
        t = spec.values(table, 'time', str(log)) * factor
    rows: Rows = np.flatnonzero(np.isfinite(t))
    if rows.size and not np.ptp(t[rows]) <= LONGEST:
        raise UserError(
            f'{log}: time runs from {t[rows].min():.6g} to {t[rows].max():.6g} s; '
            'which unit is it in?'
        )
    steps = np.diff(np.round((t[rows] - t[rows[:1]]) * 1e9))
    back = np.flatnonzero(steps < 0)
    if back.size:
        row = int(rows[back[0] + 1])
        raise UserError(
            f'{log}: time goes backwards at sample {row + 1}, from {t[rows[back[0]]]:.6g} s to '
            f'{t[row]:.6g} s; sort or cut the log'
        )
    rows = rows[np.concatenate([[True], steps > 0])] if rows.size else rows
    if rows.size < 2:
        raise UserError(f'{log}: {rows.size} samples with a time; at least 2 are needed')
    return t[rows], rows
