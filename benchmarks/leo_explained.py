# SPDX-License-Identifier: Apache-2.0
"""How much of LEO's error goes with the effect that was named, on bags that no fit saw.

    python benchmarks/leo_explained.py --first-seed 80001 --cases 20 -o out/leo_explained.jsonl

Each case is one of `leo blind --robot leo`: a hidden effect, three bags, `leo explain`. The same
robot then makes the motions with other figures and walks by the shipped policy. There the model
as given, the one with what was named, and the true one predict from the noisy measured starts:
one control step, and 0.3 s (walking, stepping) or 1 s (hanging, standing). Errors are mean squares
over the states in units of those the true model makes there. Cases that are there are kept.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
import json
from pathlib import Path
import tempfile
import time

import numpy as np

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.compare.noise import HISTORY
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import cut
from leo_diffmodel.explain.explanation import explain
from leo_lab.blind.case import Case, draw_case
from leo_lab.blind.record import record
from leo_lab.blind.scenes import Moving, Step
from leo_lab.result_lines import append_result, read_results
from leo_learner.learning.policy import Policy
from leo_sim.description.robot import Robot
from leo_sim.model import Model, State
from leo_sim.task.task import observation, Task

AHEAD = {'swinging': 1.0, 'standing': 1.0, 'stepping': 0.3, 'walking': 0.3}
WALK_SECONDS = 10.0
OTHER = 2**31
WINDOWS = 150


@dataclass(frozen=True)
class Walking:
    """The shipped policy at the wheel; a scene as `leo_lab.blind.scenes` has them."""

    robot: Robot
    count: int
    start: str = 'nominal'
    held: bool = False

    def begin(self) -> Step:
        """What drives the robot; None once it has fallen."""
        policy, task = Policy.load('leo_walk'), Task(self.robot)
        on = np.ones(len(self.robot.actuators), dtype=bool)

        def step(k: int, q: np.ndarray, dq: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
            if task.terminated(State(q, dq)):
                return None
            return policy(observation(self.robot, q, dq)), on

        return step


def held_out(case: Case, folder: Path) -> dict[str, Recording]:
    """New bags of the case's robot, by motion."""
    scenes = [replace(s, seed=s.seed ^ 1) for s in case.run.scenes if isinstance(s, Moving)]
    walk = Walking(case.robot, round(WALK_SECONDS / case.robot.control_period))
    run = replace(case.run, scenes=(*scenes, walk))
    bags = record(replace(case, seed=case.seed + OTHER, run=run), folder)
    return dict(zip(AHEAD, (read_bag(bag, case.robot) for bag in bags), strict=True))


def scores(models: Sequence[Model], bag: Recording, seconds: float) -> list[float]:
    """Squared errors of models so far ahead over those of the last, the true one."""
    total = sum(e.t[-1] - e.t[0] for e in bag.episodes)
    windows = cut([bag], seconds, stride=total / WINDOWS, history=HISTORY)
    start, end = windows.measured[:, 0], windows.measured[:, -1]
    squares = [np.square(predict(m, windows, start)[:, -1] - end).mean(axis=0) for m in models]
    return [float((square / squares[-1]).mean()) for square in squares]


def run_case(seed: int) -> dict:
    """Explain a blind case and predict its new bags."""
    case, began = draw_case(seed, 'effect', 'leo'), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        bags = record(case, Path(folder))
        recordings = [read_bag(bag, case.robot) for bag in bags]
        new = held_out(case, Path(folder) / 'new')
    answer = explain(recordings, Model(case.robot))
    given, true, repaired = (
        Model(robot, effects, engine='rigid', scheme='training')
        for robot, effects in (
            (case.robot, ()),
            (case.run.robot, case.effects),
            (answer.model.robot, answer.model.effects),
        )
    )
    hidden = [(p.effect.name, p.where[0] if len(p.where) == 1 else 'all') for p in case.effects]
    named = [(e['name'], e['where']) for e in answer.found]
    models, step = (given, repaired, true), case.robot.control_period
    table = {
        motion: {'one_step': scores(models, bag, step), 'ahead': scores(models, bag, far)}
        for (motion, bag), far in zip(new.items(), AHEAD.values(), strict=True)
    }
    return {
        'seed': seed,
        'hidden': hidden,
        'sizes': case.sizes,
        'verdict': answer.verdict,
        'named': named,
        'scores': table,
        'seconds': time.process_time() - began,
    }


def show(rows: Sequence[dict]) -> None:
    """Medians and worst over the cases."""
    for motion in AHEAD:
        one = np.sqrt([r['scores'][motion]['one_step'] for r in rows])
        far = np.array([r['scores'][motion]['ahead'] for r in rows]) - 1
        shown = far[far[:, 0] != 0]
        median = 100 * np.median(1 - shown[:, 1] / shown[:, 0])
        print(
            f'{motion}: one step, times the error of a perfect model, {np.median(one[:, 0]):.2f}'
            f' -> {np.median(one[:, 1]):.3f} (most {one[:, 1].max():.3f}); of the excess '
            f'{AHEAD[motion]:g} s ahead {100 * (1 - far[:, 1].sum() / far[:, 0].sum()):.1f} % '
            f'is gone, in the median case {median:.1f} %'
        )


def main() -> None:
    """Run what is missing and print all."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--first-seed', type=int, default=80001)
    parser.add_argument('--cases', type=int, default=20)
    parser.add_argument('-o', dest='output', type=Path, default=Path('out/leo_explained.jsonl'))
    arguments = parser.parse_args()
    rows = {r['seed']: r for r in read_results(arguments.output)}
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.cases)
    for seed in seeds:
        if seed not in rows:
            rows[seed] = run_case(seed)
            append_result(arguments.output, rows[seed])
        print(json.dumps(rows[seed]), flush=True)
    show([rows[s] for s in seeds])


if __name__ == '__main__':
    main()
