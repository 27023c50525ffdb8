# SPDX-License-Identifier: Apache-2.0
"""Robots that take goals, whose servos hide something in their loops: what explain says of it.

    python benchmarks/servo_loops.py goal_rate none old --seeds 1 2 3 --results FILE
    python benchmarks/servo_loops.py --table --results FILE

Each kind hides one effect by seed, or nothing (`none`), or an effect that the catalogue had before
these (`old`), which is explained from the same bags without these, too.
Even seeds have an XL330 on BAM's rig, its motor known, odd ones DFKI's double pendulum on servos
of 20 N m/rad. Sizes are from 2 to 30 noise floors, logs of 8 s; otherwise as in `leo blind`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
import shutil
import tempfile
from typing import Any

import numpy as np

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.explain.explanation import explain
from leo_lab.blind.case import Case, draw_case
from leo_lab.blind.drawn import log_uniform, one_of
from leo_lab.blind.excitation import excitation
from leo_lab.blind.judge import judge
from leo_lab.blind.open_loop import OpenLoop, Run
from leo_lab.blind.record import record
from leo_lab.blind.scenes import Given
from leo_lab.blind.truth import hide, reveal
from leo_lab.result_lines import append_result, read_results
from leo_sim.description.robot import named_robots
from leo_sim.effects import EFFECTS, place, Placed
from leo_sim.model import Model

VALUES = {
    'servo_stiffness': ('k', 0.6, 1.6),
    'servo_damping': ('d', 0.004, 0.06),
    'goal_rate': ('rate', 2.0, 12.0),
}
"""Parameter of each effect and the ends between which it is drawn; of the second robot's damping
20 times as much, N m s/rad."""
NEW = tuple(VALUES)
SIZES, SECONDS = (2.0, 30.0), 8.0
LIMIT = 'limit: {value: 6, unit: N m}'
LOOP = (
    'limit: {value: 3, unit: rad}\n    stiffness: {value: 20, unit: N m/rad}\n'
    '    damping: {value: 1, unit: N m s/rad}\n    effort: {value: 6, unit: N m}'
)


def robots(folder: Path) -> list[Path]:
    """The two robots, folders that are made."""
    known, stiff = (
        shutil.copytree(named_robots()[name], folder / name)
        for name in ('xl330_pendulum', 'double_pendulum')
    )
    text = (known / 'robot.yaml').read_text().replace(', uncertain: [0.2, 0.6]', '')
    (known / 'robot.yaml').write_text(text.replace(', uncertain: [1.5, 7]', ''))
    text = (stiff / 'robot.yaml').read_text().replace(LIMIT, LOOP)
    text = text.replace('input: torque', 'input: position')
    text = text.replace('integration_step: 0.0025', 'integration_step: 0.001')
    text = text.replace('quantity: input, joint', 'quantity: rate, joint')
    (stiff / 'robot.yaml').write_text(text)
    return [known, stiff]


def hidden(kind: str, run: Run, rng: np.random.Generator) -> tuple[Placed, float]:
    """An effect whose value is drawn until its size is one of `SIZES`."""
    if kind == 'old':
        return one_of(run, (), SIZES, rng, NEW)
    name, least, most = VALUES[kind]
    by = 1.0 if run.robot.has_motor_law or kind != 'servo_damping' else 20.0
    while True:
        where = str(rng.choice(EFFECTS[kind].places(run.robot)))
        value = by * log_uniform(rng, (least, most))
        placed = place(run.robot, kind, where, **{name: value})
        size = float(OpenLoop(run, (placed,)).size(placed)[0])
        if SIZES[0] < size < SIZES[1]:
            return placed, size


def case(kind: str, seed: int, robot: Path) -> Case:
    drawn = draw_case(seed, 'none', robot)
    given = excitation(drawn.run.robot, np.random.default_rng([seed, 78]), SECONDS)
    drawn = replace(drawn, run=replace(drawn.run, scenes=(Given(*given),)))
    if kind == 'none':
        return drawn
    placed, size = hidden(kind, drawn.run, np.random.default_rng([seed, 77]))
    return replace(drawn, kind='effect', effects=(placed,), sizes=(size,))


def told(kind: str, seed: int, robot: Path) -> dict[str, Any]:
    """One line: the truth and what was said of its bag."""
    one = case(kind, seed, robot)
    with tempfile.TemporaryDirectory() as folder:
        bags, truth = record(one, Path(folder)), Path(folder) / 'truth.sealed'
        hide(one, truth)
        recordings = [read_bag(bag, one.robot) for bag in bags]
        line = judge(reveal(truth), answer(recordings, one), one.robot)
        return {**line, 'asked': kind, 'before': named_before(recordings, one, kind)}


def answer(recordings: Sequence[Recording], one: Case) -> dict[str, Any]:
    return explain(recordings, Model(one.robot)).to_json()


def named_before(recordings: Sequence[Recording], one: Case, kind: str) -> list[list[str]] | None:
    """What explain names of old effects while it does not know the new ones."""
    if kind != 'old':
        return None
    new = {name: EFFECTS.pop(name) for name in NEW}
    effects = answer(recordings, one)['effects']
    EFFECTS.update(new)
    return [[e['name'], e['where']] for e in effects]


def table(lines: Sequence[dict[str, Any]]) -> None:
    for kind in dict.fromkeys(line['asked'] for line in lines):
        for robot in ('xl330_pendulum', 'double_pendulum'):
            mine = [x for x in lines if x['asked'] == kind and x['robot'] == robot]
            held = [e['inside'] for x in mine if x['right'] for e in x['errors']]
            right, inside = sum(x['right'] for x in mine), sum(map(bool, held))
            print(f'{kind}, {robot}: right {right} of {len(mine)}; inside {inside} of {len(held)}')
    old = [x for x in lines if x['asked'] == 'old']
    same = sum(x['named'] == x['before'] for x in old)
    print(f'named the same before and after: {same} of {len(old)}')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('kinds', nargs='*', help=f'of {", ".join((*NEW, "none", "old"))}')
    parser.add_argument('--seeds', type=int, nargs='+', default=range(1, 21))
    parser.add_argument('--results', type=Path, required=True)
    parser.add_argument('--table', action='store_true')
    options = parser.parse_args()
    if options.table:
        table(read_results(options.results))
        return
    done = {(x['asked'], x['seed']) for x in read_results(options.results)}
    with tempfile.TemporaryDirectory() as folder:
        both = robots(Path(folder))
        for seed in options.seeds:
            for kind in options.kinds:
                if (kind, seed) not in done:
                    line = told(kind, seed, both[seed % 2])
                    append_result(options.results, line)
                    print(kind, seed, line['verdict'], line['set'], line['right'], flush=True)


if __name__ == '__main__':
    main()
