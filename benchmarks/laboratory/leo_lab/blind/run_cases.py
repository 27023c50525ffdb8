# SPDX-License-Identifier: Apache-2.0
"""Run blind cases by several workers and append one line per case to a results file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
import sys
import tempfile
import time
import traceback
from typing import NamedTuple

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.explain.explanation import explain
from leo_lab.blind import faulty_logs
from leo_lab.blind.case import draw_case, engine_of, robot_name
from leo_lab.blind.floors import with_floors
from leo_lab.blind.judge import judge
from leo_lab.blind.progress import counted
from leo_lab.blind.record import record
from leo_lab.blind.seeds import check_seeds
from leo_lab.blind.table import SHARES
from leo_lab.blind.truth import hide, reveal
from leo_lab.origin import origin
from leo_lab.result_lines import append_result, read_results
from leo_lab.workers import ONE, Workers
from leo_sim.description.robot import Robot
from leo_sim.model import Model

SIZED, OF_LOGS = ('small',), ('fault', 'sound')
"""Kinds whose judge asks how large the named effects are, and kinds of `faulty_logs`."""


def run_case(seed: int, kind: str, robot: str | Path | None = None) -> dict:
    """Draw, seal the truth, explain from the bags alone, and only then judge."""
    case = draw_case(seed, kind, robot)
    with tempfile.TemporaryDirectory() as folder:
        truth = Path(folder) / 'truth.sealed'
        bags = record(case, Path(folder))
        hide(case, truth)
        answer = _explained(bags, case.robot)
        if kind in SIZED:
            answer = with_floors(case, answer)
        return judge(reveal(truth), answer, case.robot)


def _explained(bags: Sequence[Path], robot: Robot) -> dict:
    """What is said of bags of a robot that is as everybody knows it."""
    recordings = [read_bag(bag, robot) for bag in bags]
    return explain(recordings, Model(robot)).to_json()


class Task(NamedTuple):
    """A case that is to be run.

    Attributes:
        kind: of `KINDS`.
        seed: of everything drawn.
        robot: see `draw_case`.
    """

    kind: str
    seed: int
    robot: str | Path | None = None


def run(
    seeds: Sequence[int],
    kind: str,
    results: Path,
    workers: Workers = ONE,
    robot: str | Path | None = None,
    examination: bool = False,
) -> list[dict]:
    """All cases of `seeds`; those already in `results` are not run again.

    A case that ends with an error is told on stderr and left out; it runs again the next time.

    Args:
        seeds: of the cases.
        kind: of `KINDS`.
        results: a file to which one line per case is appended.
        workers: who runs them.
        robot: see `draw_case`.
        examination: no seed twice, and none that development may use.

    Raises:
        UserError: a seed that this run may not use; nothing has run then.
    """
    lines = read_lines(results)
    check_seeds(kind, seeds, lines, examination)
    done = {r['seed']: r for r in lines if r['kind'] == kind}
    todo = [Task(kind, seed, robot) for seed in seeds if seed not in done]
    rows = answers(todo, workers, examination)
    for row in counted(rows, 0, len(todo), f'blind cases ({kind})'):
        if 'error' in row:
            tell_error(row)
            continue
        done[row['seed']] = row
        append_result(results, row)
    return [done[s] for s in seeds if s in done]


def answers(tasks: Sequence[Task], workers: Workers, examination: bool) -> Iterator[dict]:
    """The lines of cases, as they come; where a case ended with an error it is `error`."""
    return workers.each(partial(_answer, examination=examination), tasks)


def _answer(task: Task, examination: bool) -> dict:
    """The line of a case, or what went wrong: one case must not end hundreds of others."""
    began = time.process_time()
    try:
        row = _run(task)
    except Exception as error:  # noqa: BLE001
        at = traceback.extract_tb(error.__traceback__)[-1]
        row = {
            **_no_answer(task),
            'error': f'{error!r} ({at.filename}:{at.lineno})',
            'of_machine': isinstance(error, OSError | MemoryError),
        }
    asked = task.robot and Path(task.robot).name
    spent = time.process_time() - began
    told = {'cpu_seconds': spent, 'asked': asked, 'examination': examination}
    return {**row, **told, **origin()}


def _run(task: Task) -> dict:
    if task.kind in OF_LOGS:
        return faulty_logs.run_case(task.seed, task.kind)
    return run_case(task.seed, task.kind, task.robot)


def _no_answer(task: Task) -> dict:
    """The line of a case that ended with an error: nothing in it is right."""
    return {
        'kind': task.kind,
        'seed': task.seed,
        'robot': Path(task.robot).name if task.robot else robot_name(task.seed),
        'engine': engine_of(task.seed, walks=False)[0],
        **dict.fromkeys(SHARES[task.kind], False),
        'effects': [],
        'verdict': 'error',
        'named': [],
        'errors': [],
        'seconds': 0.0,
    }


def tell_error(row: dict) -> None:
    """Say on stderr what ended a case."""
    print(f'leo blind: {row["kind"]} {row["seed"]} has no answer: {row["error"]}', file=sys.stderr)


def read_lines(results: Path) -> list[dict]:
    """The lines of cases in a results file; none where there is no file."""
    return [line for line in read_results(results) if 'kind' in line]
