# SPDX-License-Identifier: Apache-2.0
"""Run blind cases over the cores and append one line per case to a results file."""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path
import tempfile

from joblib import delayed, Parallel
from rich.progress import track

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.blind.case import draw_case
from leo_diffmodel.blind.judge import judge
from leo_diffmodel.blind.record import record
from leo_diffmodel.blind.truth import hide, reveal
from leo_diffmodel.explain.explanation import explain
from leo_sim.model import Model
from leo_sim.robot import Robot


def run_case(seed: int, kind: str, walker: str | Path | None = None) -> dict:
    """Draw, seal the truth, explain from the bags alone, and only then judge."""
    with tempfile.TemporaryDirectory() as folder:
        truth = Path(folder) / 'truth.sealed'
        robot, bags = _prepare(seed, kind, walker, Path(folder), truth)
        recordings = [read_bag(bag, robot) for bag in bags]
        answer = explain(recordings, Model(robot)).to_json()
        return judge(reveal(truth), answer, robot)


def _prepare(
    seed: int, kind: str, walker: str | Path | None, folder: Path, truth: Path
) -> tuple[Robot, list[Path]]:
    """Record the bags of a case; returns its robot as everybody knows it, and the bags."""
    case = draw_case(seed, kind, walker)
    bags = record(case, folder)
    hide(case, truth)
    return case.robot, bags


def run(
    seeds: Sequence[int], kind: str, results: Path, jobs: int, walker: str | Path | None = None
) -> list[dict]:
    """All cases of `seeds`; those already in `results` are not run again."""
    lines = [json.loads(line) for line in _lines(results)]
    done = {r['seed']: r for r in lines if r['kind'] == kind}
    todo = [s for s in seeds if s not in done]
    tasks = (delayed(run_case)(seed, kind, walker) for seed in todo)
    rows = Parallel(n_jobs=jobs, return_as='generator_unordered')(tasks)
    results.parent.mkdir(parents=True, exist_ok=True)
    with results.open('a') as file:
        for row in track(rows, total=len(todo), description=f'blind cases ({kind})'):
            file.write(json.dumps(row) + '\n')
            file.flush()
            done[row['seed']] = row
    return [done[s] for s in seeds]


def _lines(results: Path) -> list[str]:
    return results.read_text().splitlines() if results.exists() else []
