# SPDX-License-Identifier: Apache-2.0
"""Run blind cases by several workers and append one line per case to a results file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
import sys
import tempfile
import traceback
from typing import NamedTuple

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.explain.explanation import explain
from leo_lab.blind.case import draw_case, engine_of, robot_name
from leo_lab.blind.floors import with_floors
from leo_lab.blind.judge import judge
from leo_lab.blind.origin import check_seeds, stamp
from leo_lab.blind.progress import counted
from leo_lab.blind.record import record
from leo_lab.blind.table import SHARES
from leo_lab.blind.truth import hide, reveal
from leo_lab.result_lines import append_result, read_results
from leo_lab.workers import ONE, Workers
from leo_sim.description.robot import Robot
from leo_sim.model import Model

SIZED = ('small',)
"""Kinds whose judge asks how large the named effects are."""


def run_case(seed: int, kind: str, walker: str | Path | None = None, mujoco: bool = True) -> dict:
    """Draw, seal the truth, explain from the bags alone, and only then judge."""
    case = draw_case(seed, kind, walker, mujoco)
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
        walker: see `draw_case`.
    """

    kind: str
    seed: int
    walker: str | Path | None = None


def run(
    seeds: Sequence[int],
    kind: str,
    results: Path,
    workers: Workers = ONE,
    walker: str | Path | None = None,
    mujoco: bool = True,
    examination: bool = False,
) -> list[dict]:
    """All cases of `seeds`; those already in `results` are not run again.

    A case that ends with an error is told on stderr and left out; it runs again the next time.

    Args:
        seeds: of the cases.
        kind: of `KINDS`.
        results: a file to which one line per case is appended.
        workers: who runs them.
        walker: see `draw_case`.
        mujoco: see `draw_case`.
        examination: no seed twice, and none that development may use.

    Raises:
        UserError: a seed that this run may not use; nothing has run then.
    """
    lines = read_lines(results)
    check_seeds(kind, seeds, lines, examination)
    done = {r['seed']: r for r in lines if r['kind'] == kind}
    todo = [Task(kind, seed, walker) for seed in seeds if seed not in done]
    rows = answers(todo, workers, mujoco, examination)
    for row in counted(rows, 0, len(todo), f'blind cases ({kind})'):
        if 'error' in row:
            tell_error(row)
            continue
        done[row['seed']] = row
        append_result(results, row)
    return [done[s] for s in seeds if s in done]


def answers(
    tasks: Sequence[Task], workers: Workers, mujoco: bool, examination: bool
) -> Iterator[dict]:
    """The lines of cases, as they come; where a case ended with an error it is `error`."""
    return workers.each(partial(_answer, mujoco=mujoco, examination=examination), tasks)


def _answer(task: Task, mujoco: bool, examination: bool) -> dict:
    """The line of a case, or what went wrong: one case must not end hundreds of others."""
    options = {} if mujoco else {'mujoco': False}
    try:
        row = run_case(task.seed, task.kind, task.walker, **options)
    except Exception as error:  # noqa: BLE001
        at = traceback.extract_tb(error.__traceback__)[-1]
        row = {
            **_no_answer(task, mujoco),
            'error': f'{error!r} ({at.filename}:{at.lineno})',
            'of_machine': isinstance(error, OSError | MemoryError),
        }
    return {**row, **stamp(examination)}


def _no_answer(task: Task, mujoco: bool) -> dict:
    """The line of a case that ended with an error: nothing in it is right."""
    walks = task.walker is not None
    return {
        'kind': task.kind,
        'seed': task.seed,
        'robot': Path(task.walker).name if task.walker else robot_name(task.seed),
        'engine': engine_of(task.seed, task.kind, walks, mujoco)[0],
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
