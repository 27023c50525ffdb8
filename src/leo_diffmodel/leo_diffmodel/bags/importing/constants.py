# SPDX-License-Identifier: Apache-2.0
"""What logs say of the robot they were made with: its payload, a length, a gain."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.description.robot import load_robot

from .column_map import ColumnMap
from .expression import Column, Table

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
