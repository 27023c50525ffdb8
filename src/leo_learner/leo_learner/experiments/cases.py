# SPDX-License-Identifier: Apache-2.0
"""The cases of an experiment: one line each in a results file, which are not run again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

from joblib import delayed, Parallel, parallel_config
import numpy as np

from leo_msgs_py.errors import one_line, UserError

C = TypeVar('C')
"""A case: a frozen dataclass whose fields begin its line in the results file."""
Row = dict[str, Any]


def read_results(path: Path) -> list[Row]:
    """The lines of a results file; none where there is no file.

    A line that was cut short is left out: its case is run again.

    Raises:
        UserError: it is no results file.
    """
    if not path.exists():
        return []
    try:
        lines = path.read_text().splitlines()
    except (OSError, ValueError) as error:
        raise UserError(f'{path} cannot be read ({one_line(error)}); give another') from error
    rows = [row for line in lines if (row := _row(line)) is not None]
    if lines and not rows:
        raise UserError(f'{path} is no results file: no line of it is a case; give another')
    return rows


def _row(line: str) -> Row | None:
    """What a line says; None where it is no case, or part of one."""
    try:
        row = json.loads(line)
    except ValueError:
        return None
    return row if isinstance(row, dict) else None


def _append(path: Path, row: Row) -> None:
    """Add a line, behind the end of one that was cut short."""
    cut = path.exists() and path.read_bytes()[-1:] not in (b'', b'\n')
    with path.open('a') as file:
        file.write('\n' * cut + json.dumps(row) + '\n')


def found(case: C, rows: Sequence[Row]) -> Row | None:
    """The line of a case among others."""
    return next((row for row in rows if vars(case).items() <= row.items()), None)


def missing(cases: Sequence[C], path: Path) -> list[C]:
    """The cases that a results file has no line of."""
    rows = read_results(path)
    return [case for case in cases if found(case, rows) is None]


def run_cases(
    cases: Sequence[C], run: Callable[[C], Row], path: Path, jobs: int = 1,
    backend: str = 'loky',
) -> Iterator[Row]:
    """Run those cases that the results file lacks and append their lines as they come.

    Args:
        cases: of the experiment.
        run: makes the line of a case; what it had begun before it goes on with.
        path: of the results file.
        jobs: processes at once.
        backend: of joblib; `dask` or `ray` once registered, for a cluster.

    Yields:
        each new line.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with parallel_config(backend, n_jobs=jobs):
        rows = Parallel(return_as='generator_unordered')(
            delayed(run)(case) for case in missing(cases, path)
        )
        for row in rows:
            _append(path, row)
            yield row


def hours(cases: Sequence[C], path: Path, jobs: int, weight: Callable[[Any], float]) -> float:
    """How long the missing cases will take, by the lines of the results file.

    Args:
        cases: of the experiment.
        path: of the results file.
        jobs: processes at once.
        weight: seconds that a case (or a line, as a namespace) would take at an assumed speed;
            the lines that are there say how true that is.
    """
    seconds = sum(weight(case) for case in missing(cases, path))
    return seconds * pace(read_results(path), weight) / jobs / 3600


def pace(rows: Sequence[Row], weight: Callable[[Any], float]) -> float:
    """How many times the assumed time lines took: the median over all time that was spent.

    A case that found its work done took no time, and so it does not count.
    """
    if not rows:
        return 1.0
    paces = sorted((row['seconds'] / weight(SimpleNamespace(**row)), row['seconds'])
                   for row in rows)  # fmt: skip
    pace, seconds = np.array(paces).T
    spent = np.cumsum(seconds)
    return float(pace[np.searchsorted(spent, spent[-1] / 2)])
