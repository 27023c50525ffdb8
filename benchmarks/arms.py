# SPDX-License-Identifier: Apache-2.0
"""Arms that are wrong at every joint: what `leo explain` names, and whether its intervals hold.

    python -m benchmarks.arms friction:980001 payload:980021 one:980051 -o out
    python -m benchmarks.arms --table out/arms.jsonl

A case is CASE:SEED of ../shared/cases/arm_everywhere.py (friction, payload, masses, one, none):
MuJoCo simulates the arm, and the model is right but for what the case says. The first log is
learned from, the second held out. What has a line in the results is not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
import json
from pathlib import Path
import subprocess
import sys
import time

from benchmarks.rig import DATA, imported
import numpy as np

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.explain.explanation import explain
from leo_lab.result_lines import append_result, read_results
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

SCRIPT = DATA.parent / 'cases/arm_everywhere.py'
LOSSES = {'viscous_friction': ('viscous', 'b'), 'coulomb_friction': ('dry', 'c')}
"""Effects, and what the truth calls them and their parameter."""


def answered(case: str, seed: int, folder: Path, within: float) -> dict:
    """The line of one case."""
    made = [sys.executable, str(SCRIPT), str(folder), case, str(seed)]
    subprocess.run(made, check=True)
    logs = [folder / 'learn.csv', folder / 'held.csv']
    imported(logs, str(folder / 'map.yaml'), folder / 'bags')
    robot = load_robot(folder / 'robot')
    learn, held = (read_bag(folder / 'bags' / log.stem, robot) for log in logs)
    began, cpu = time.monotonic(), time.process_time()
    answer = explain([learn], Model(robot), [held], within=within)
    return {
        'case': case,
        'seed': seed,
        'joints': len(robot.joint_names),
        'truth': json.loads((folder / 'truth.json').read_text()),
        'verdict': answer.verdict,
        'sentence': answer.sentence,
        'effects': answer.found,
        'not_sure': len(answer.not_sure),
        'faults': answer.log_faults,
        'errors': answer.errors.get('ladder', []),
        'seconds': time.monotonic() - began,
        'cpu_seconds': time.process_time() - cpu,
    }


def losses(line: dict) -> Iterator[tuple[str, float, float | None, bool]]:
    """Each friction and payload: its place, its value, what was found, and is it inside."""
    found = {f'{e["name"]}:{e["where"]}': e['parameters'] for e in line['effects']}
    there = [
        (f'{name}:joint_{number}', parameter, value)
        for name, (key, parameter) in LOSSES.items()
        for number, value in enumerate(line['truth'][key], 1)
    ]
    load = (line['truth']['payload'] or [0.0])[0]
    for place, parameter, value in (*there, (f'payload:link_{line["joints"]}', 'm', load)):
        told = found.get(place, {}).get(parameter)
        inside = told is not None and told['ci95'][0] <= value <= told['ci95'][1]
        if value:
            yield place, value, told and told['value'], inside


def beside(line: dict) -> list[str]:
    """Effects that are named and are not there; a payload has an inertia of its own."""
    there = {place for place, *_ in losses(line)}
    if line['truth']['payload']:
        there.add(f'link_inertia:link_{line["joints"]}')
    return [label for e in line['effects'] if (label := f'{e["name"]}:{e["where"]}') not in there]


def table(lines: Sequence[dict]) -> Iterator[str]:
    """A line of text for each case, and one for each kind."""
    for case in dict.fromkeys(line['case'] for line in lines):
        mine = sorted((x for x in lines if x['case'] == case), key=lambda x: x['seed'])
        every = [loss for line in mine for loss in losses(line)]
        named = sum(value is not None for *_, value, _ in every)
        inside = sum(holds for *_, holds in every)
        cpu = float(np.median([line['cpu_seconds'] for line in mine]))
        yield (
            f'{case}: {len(mine)} arms, {named} of {len(every)} frictions and payloads, '
            f'{inside} inside their intervals, {cpu:.0f} s of CPU (median)'
        )
        for line in mine:
            missed = [place for place, _, value, _ in losses(line) if value is None]
            yield (
                f'  {line["seed"]}: {line["joints"]} joints, {line["verdict"]}, missed {missed}, '
                f'beside {beside(line)}, {line["cpu_seconds"]:.0f} s'
            )


def main() -> int:
    """Run what has no line yet, and tell all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('cases', nargs='*', metavar='CASE:SEED')
    parser.add_argument('--within', type=float, default=np.inf, help='s for each answer')
    parser.add_argument('-o', '--output', type=Path, default=Path('out/arms'))
    parser.add_argument('--table', type=Path, metavar='FILE.jsonl')
    options = parser.parse_args()
    file = options.table or options.output / 'arms.jsonl'
    for text in options.cases:
        case, seed = text.split(':')
        if not any(x['case'] == case and x['seed'] == int(seed) for x in read_results(file)):
            folder = options.output / f'{case}_{seed}'
            append_result(file, answered(case, int(seed), folder, options.within))
    print('\n'.join(table(read_results(file))))
    return 0


if __name__ == '__main__':
    sys.exit(main())
