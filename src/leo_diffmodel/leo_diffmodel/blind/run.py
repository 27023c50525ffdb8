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
from leo_diffmodel.explain.explanation import explain
from leo_sim.model import Model


def run_case(seed: int, with_effect: bool) -> dict:
    """Draw, record, explain from the bag alone, and only then judge."""
    case = draw_case(seed, with_effect)
    with tempfile.TemporaryDirectory() as folder:
        bag = record(case, Path(folder) / 'bag')
        recording = read_bag(bag, case.robot)
        answer = explain([recording], Model(case.robot)).to_json()
    return judge(case, answer)


def run(seeds: Sequence[int], with_effect: bool, results: Path, jobs: int) -> list[dict]:
    """All cases of `seeds`; those already in `results` are not run again."""
    lines = [json.loads(line) for line in _lines(results)]
    done = {r['seed']: r for r in lines if (r['truth'] is not None) == with_effect}
    todo = [s for s in seeds if s not in done]
    tasks = (delayed(run_case)(seed, with_effect) for seed in todo)
    rows = Parallel(n_jobs=jobs, return_as='generator_unordered')(tasks)
    results.parent.mkdir(parents=True, exist_ok=True)
    with results.open('a') as file:
        for row in track(rows, total=len(todo), description='blind cases'):
            file.write(json.dumps(row) + '\n')
            file.flush()
            done[row['seed']] = row
    return [done[s] for s in seeds]


def _lines(results: Path) -> list[str]:
    return results.read_text().splitlines() if results.exists() else []
