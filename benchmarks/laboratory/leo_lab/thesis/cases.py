# SPDX-License-Identifier: Apache-2.0
"""The cases of an experiment: one line each in a results file, which are not run again."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import accumulate
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

from leo_lab.origin import origin
from leo_lab.result_lines import append_result, read_results, Row
from leo_lab.workers import ONE, Workers

C = TypeVar('C')
"""A case: a frozen dataclass whose fields begin its line in the results file."""
K = TypeVar('K')


def found(case: C, rows: Sequence[Row]) -> Row | None:
    """The line of a case among others."""
    return next((row for row in rows if vars(case).items() <= row.items()), None)


def grouped(cases: Sequence[C], rows: Sequence[Row], key: Callable[[C], K]) -> dict[K, list[Row]]:
    """The lines of the cases, those with the same key together."""
    groups: dict[K, list[Row]] = {}
    for case in cases:
        if row := found(case, rows):
            groups.setdefault(key(case), []).append(row)
    return groups


def missing(cases: Sequence[C], path: Path) -> list[C]:
    """The cases that a results file has no line of."""
    rows = read_results(path)
    return [case for case in cases if found(case, rows) is None]


def run_cases(
    cases: Sequence[C], run: Callable[[C], Row], path: Path, workers: Workers = ONE
) -> Iterator[Row]:
    """Run those cases that the results file lacks and append their lines as they come.

    Args:
        cases: of the experiment.
        run: makes the line of a case; what it had begun before it goes on with.
        path: of the results file.
        workers: who runs them.

    Yields:
        each new line.
    """
    for row in workers.each(partial(_line, run), missing(cases, path)):
        append_result(path, row)
        yield row


def _line(run: Callable[[C], Row], case: C) -> Row:
    """What a case comes to, and by which code and machine."""
    return {**run(case), **origin()}


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
    paces = sorted(
        (row['seconds'] / weight(SimpleNamespace(**row)), row['seconds']) for row in rows
    )
    spent = list(accumulate(seconds for _, seconds in paces))
    return paces[bisect_left(spent, spent[-1] / 2)][0]
