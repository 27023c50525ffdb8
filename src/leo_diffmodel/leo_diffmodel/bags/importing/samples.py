# SPDX-License-Identifier: Apache-2.0
"""Which rows of a log become samples, and what is said of the others."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError

from ..arrays import LONGEST, Run
from ..types import APPLIED
from .column_map import ColumnMap, ColumnSpec, QUANTITIES, unit_factor
from .log_format import Column, Table

FEWEST = 2  # samples of a run
NO_TIME = 'without a time'
REPEATED = 'with the time of the row before'
LeftOut = Counter[str]  # how many rows for each reason


def times(
    log: Path, table: Table, mapping: ColumnMap
) -> tuple[Column, NDArray[np.int64], LeftOut]:
    if mapping.time.period is not None:
        t = np.arange(len(next(iter(table.values()))), dtype=float) * mapping.time.period
    else:
        factor = unit_factor(mapping.time.unit, 'time', str(log), QUANTITIES['time'])
        t = ColumnSpec(column=mapping.time.column).values(table, 'time', str(log)) * factor
    timed = np.flatnonzero(np.isfinite(t))
    if timed.size and not np.ptp(t[timed]) <= LONGEST:
        raise UserError(
            f'{log}: time runs from {t[timed].min():.6g} to {t[timed].max():.6g} s; '
            'which unit is it in?'
        )
    steps = np.diff(np.round((t[timed] - t[timed[:1]]) * 1e9))
    _refuse_backwards(log, t, timed, steps)
    rows = timed[np.concatenate([[True], steps > 0])] if timed.size else timed
    if rows.size < FEWEST <= timed.size:
        raise UserError(
            f'{log}: the time column {mapping.time.column} does not change; name the one that '
            'counts the time, or say time: {period: SECONDS}'
        )
    if rows.size < FEWEST:
        raise UserError(f'{log}: {rows.size} samples with a time; at least {FEWEST} are needed')
    return t[rows], rows, LeftOut({NO_TIME: len(t) - timed.size, REPEATED: timed.size - rows.size})


def _refuse_backwards(log: Path, t: Column, rows: NDArray[np.int64], steps: Column) -> None:
    back = np.flatnonzero(steps < 0)
    if back.size:
        row = int(rows[back[0] + 1])
        raise UserError(
            f'{log}: time goes backwards at sample {row + 1}, from {t[rows[back[0]]]:.6g} s to '
            f'{t[row]:.6g} s; sort or cut the log'
        )


def incomplete(log: Path, run: Run, mapping: ColumnMap) -> LeftOut:
    """Return how many samples lack a position or a speed; refuse a log with too few others."""
    columns = {
        spec.source: values[:, k]
        for quantity, values in (('position', run.q), ('velocity', run.dq))
        for k, joint in enumerate(mapping.joints.values())
        if values is not None and (spec := getattr(joint, quantity))
        if quantity == 'position' or np.isfinite(values[:, k]).any()
    }
    whole = np.isfinite(list(columns.values())).all(axis=0)
    gaps = [name for name, values in columns.items() if not np.isfinite(values).all()]
    if whole.sum() < FEWEST:
        raise UserError(
            f'{log}: {whole.sum()} rows have a number for {" and ".join(gaps)}; at least {FEWEST} '
            'are needed: is that the right column?'
        )
    return LeftOut({f'without a number for {" or ".join(gaps)}': int((~whole).sum())})


def refuse_unknown_inputs(log: Path, run: Run, mapping: ColumnMap) -> None:
    for joint, specs in mapping.inputs.items():
        values = run.inputs[joint]
        off = 'enabled' in values and (values['enabled'] <= 0.5).all()
        for name in specs.keys() & APPLIED.keys():
            if not off and not np.isfinite(values[name]).any():
                raise UserError(
                    f'{log}: {specs[name].source} ({name} of {joint}) holds no number; name '
                    'another column, or import this log without it if the motors were off'
                )


def sentences(left_out: Mapping[Path, LeftOut], rows: Mapping[Path, int]) -> list[str]:
    return [
        f'{log}: {found.total()} of {rows[log]} rows left out: '
        + ', '.join(f'{count} {why}' for why, count in found.items() if count)
        for log, found in left_out.items()
        if found.total()
    ]
