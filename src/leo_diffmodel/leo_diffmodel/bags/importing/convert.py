# SPDX-License-Identifier: Apache-2.0
"""Logs to bags by a column map, with the constants of the robot that they know."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
import json
from pathlib import Path
import shutil

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_sim.common.yaml_file import read
from leo_sim.description.robot import load_robot, named_robots

from ..arrays import Run, write_runs
from ..types import APPLIED, Floats
from .column_map import ColumnMap, ColumnSpec
from .log_format import Column, Table
from .samples import incomplete, LeftOut, refuse_unknown_inputs, sentences, times
from .shipped import shipped_maps
from .tables import episodes_of

SAME = 1e-9  # of a constant: what is less is no difference between two rows or logs


def import_logs(
    logs: Iterable[str | Path],
    column_map: str | Path | ColumnMap,
    bag: str | Path,
    join: bool = False,
) -> Path:
    """Write logs to a new bag, an episode per run in them, and return its folder.

    With `join`, or where names as q.csv and dq.csv say so, they are parts of one run.
    """
    mapping, paths = load_map(column_map), [Path(log) for log in logs]
    tables, how_joined = episodes_of(paths, mapping, join)
    if not tables:
        raise UserError('no logs to import; name at least one file')
    runs, left_out = _runs(tables, mapping)
    said = [joint for joint, columns in mapping.joints.items() if columns.position.says_unit]
    inputs = (spec for of in mapping.inputs.values() for spec in of.items())
    metadata = {
        'imported_from': ', '.join(log.name for log in paths),
        'column_map': 'column map' if isinstance(column_map, ColumnMap) else str(column_map),
        'angle_units_said': ', '.join(said),
        'left_out': '\n'.join(left_out) or None,
        'joined': how_joined or None,
        'inputs_from': ', '.join(spec.source for n, spec in inputs if n in APPLIED) or None,
        'robot': mapping.robot or None,
        'constants': json.dumps(_known_constants(tables, mapping)) if mapping.constants else None,
    }
    known = {name: text for name, text in metadata.items() if text is not None}
    return write_runs(Path(bag), runs, known)


@contextmanager
def undone_on_error(output: Path) -> Iterator[list[Path]]:
    """Yield a list for the bags that are made; on an error or Ctrl-C they and new folders go."""
    made: list[Path] = []
    new = [folder for folder in (output, *output.parents) if not folder.exists()]
    try:
        yield made
    except BaseException:
        for bag in made:
            shutil.rmtree(bag, ignore_errors=True)
        for folder in new:
            with suppress(OSError):  # not empty: others have put something there
                folder.rmdir()
        raise


def load_map(source: str | Path | ColumnMap) -> ColumnMap:
    if isinstance(source, ColumnMap):
        return source
    if Path(source).is_file():
        found = read(Path(source), ColumnMap)
        folder = Path(source).parent / (found.robot or '')  # a path counts from the map
        is_path = found.robot and found.robot not in named_robots() and folder.is_dir()
        return found.model_copy(update={'robot': str(folder)}) if is_path else found
    shipped = shipped_maps()
    name = str(source).removesuffix('.yaml')
    if name not in shipped:
        raise UserError(f'no column map {source}{nearest(Path(name).name, shipped)}')
    return read(shipped[name], ColumnMap)


def _runs(tables: Sequence[tuple[Path, Table]], mapping: ColumnMap) -> tuple[list[Run], list[str]]:
    runs, left_out, rows = [], defaultdict[Path, LeftOut](LeftOut), Counter[Path]()
    for log, table in tables:
        run, found = _run(log, table, mapping)
        runs.append(run)
        left_out[log] += found
        rows[log] += len(next(iter(table.values())))
    return runs, sentences(left_out, rows)


def _run(log: Path, table: Table, mapping: ColumnMap) -> tuple[Run, LeftOut]:
    t, rows, left_out = times(log, table, mapping)

    def values(spec: ColumnSpec | None, quantity: str) -> Column:
        missing = np.full(len(rows), np.nan)
        return missing if spec is None else spec.values(table, quantity, str(log))[rows]

    def matrix(quantity: str) -> Floats | None:
        specs = [getattr(columns, quantity) for columns in mapping.joints.values()]
        return np.column_stack([values(s, quantity) for s in specs]) if any(specs) else None

    q = matrix('position')
    assert q is not None
    inputs = {
        joint: {str(name): values(spec, name) for name, spec in interfaces.items()}
        for joint, interfaces in mapping.inputs.items()
    }
    run = Run(t, list(mapping.joints), q, matrix('velocity'), matrix('effort'), inputs)
    refuse_unknown_inputs(log, run, mapping)
    return run, left_out + incomplete(log, run, mapping)


def _known_constants(tables: Sequence[tuple[Path, Table]], mapping: ColumnMap) -> dict[str, float]:
    assert mapping.robot is not None
    robot, found = load_robot(mapping.robot), {}
    for path, spec in mapping.constants.items():
        if path not in robot.constants:
            raise UserError(
                f'column map: constants: {robot.name} has no {path!r}'
                f'{nearest(path, robot.constants)}'
            )
        unit = robot.constants[path].unit
        values = [(log, spec.values(table, path, str(log), unit)) for log, table in tables]
        found[path] = _one(path, [(log, _single(path, log, v)) for log, v in values])
    return found


def _single(path: str, log: Path, values: Column) -> float:
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
    first, value = values[0]
    for log, other in values:
        if abs(other - value) > SAME * max(abs(other), abs(value)):
            raise UserError(
                f'{path} is {value:.6g} in {first} and {other:.6g} in {log}; '
                'give each log a bag of its own (--bag-per-log)'
            )
    return value
