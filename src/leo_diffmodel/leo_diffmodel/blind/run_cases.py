# SPDX-License-Identifier: Apache-2.0
"""Run blind cases over the cores and append one line per case to a results file."""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path
import sys
import tempfile
import traceback
from typing import Any

from joblib import delayed, Parallel
from rich.progress import track

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.blind.case import draw_case
from leo_diffmodel.blind.floors import with_floors
from leo_diffmodel.blind.judge import judge
from leo_diffmodel.blind.origin import check_seeds, stamp
from leo_diffmodel.blind.record import record
from leo_diffmodel.blind.truth import hide, reveal
from leo_diffmodel.explain.explanation import explain
from leo_sim.description.robot import Robot
from leo_sim.model import Model

SIZED = ('small',)
"""Kinds whose judge asks how large the named effects are."""


def run_case(
    seed: int, kind: str, walker: str | Path | None = None, mujoco: bool = True
) -> dict:
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


def run(
    seeds: Sequence[int], kind: str, results: Path, jobs: int, walker: str | Path | None = None,
    mujoco: bool = True, examination: bool = False,
) -> list[dict]:
    """All cases of `seeds`; those already in `results` are not run again.

    A case that ends with an error is told on stderr and left out; it runs again the next time.

    Args:
        seeds: of the cases.
        kind: of `KINDS`.
        results: a file to which one line per case is appended.
        jobs: processes.
        walker: see `draw_case`.
        mujoco: see `draw_case`.
        examination: no seed twice, and none that development may use.

    Raises:
        UserError: a seed that this run may not use; nothing has run then.
    """
    lines = read_lines(results)
    check_seeds(kind, seeds, lines, examination)
    done = {r['seed']: r for r in lines if r['kind'] == kind}
    todo = [s for s in seeds if s not in done]
    options = {} if mujoco else {'mujoco': False}
    tasks = (delayed(_tried)(seed, kind, walker, **options) for seed in todo)
    rows = Parallel(n_jobs=jobs, return_as='generator_unordered')(tasks)
    results.parent.mkdir(parents=True, exist_ok=True)
    with results.open('a') as file:
        for row in track(rows, total=len(todo), description=f'blind cases ({kind})'):
            if isinstance(row, str):
                print(f'leo blind: {row}', file=sys.stderr)
                continue
            done[row['seed']] = {**row, **stamp(examination)}
            file.write(json.dumps(done[row['seed']]) + '\n')
            file.flush()
    return [done[s] for s in seeds if s in done]


def _tried(seed: int, kind: str, *given: Any, **options: Any) -> dict | str:
    """The row of a case, or what went wrong: one case must not end hundreds of others."""
    try:
        return run_case(seed, kind, *given, **options)
    except Exception as error:  # noqa: BLE001
        at = traceback.extract_tb(error.__traceback__)[-1]
        return f'{kind} {seed} has no answer: {error!r} ({at.filename}:{at.lineno})'


def read_lines(results: Path) -> list[dict]:
    """The lines of a results file; none where there is no file."""
    text = results.read_text() if results.exists() else ''
    return [json.loads(line) for line in text.splitlines()]
