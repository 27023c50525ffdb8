# SPDX-License-Identifier: Apache-2.0
"""Robots that take goals, whose servos hide something in their loops: what a search chooses.

    python benchmarks/servo_loops.py goal_rate none old --seeds 1 2 3 --results FILE
    python benchmarks/servo_loops.py --table --results FILE

Each kind hides one effect by seed, or nothing (`none`), or an effect that the catalogue had before
these (`old`), which is searched for in the same log without these, too. Even seeds have an XL330
on BAM's rig, its motor known, odd ones DFKI's double pendulum on servos of 20 N m/rad. Sizes are
from 2 to 30 noise floors, logs of 8 s from a finer integration; the search is that of `leo
explain`, without its verdict.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import shutil
import tempfile
import time
from typing import Any

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.explain.problem.classes import Facts, why_same
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.select.search import search
from leo_diffmodel.explain.settings import SETTINGS
from leo_lab.blind.drawn import log_uniform, place_of
from leo_lab.blind.excitation import excitation
from leo_lab.blind.open_loop import Run
from leo_lab.blind.scenes import Given
from leo_lab.result_lines import append_result, read_results
from leo_sim.description.robot import load_robot, named_robots, Robot
from leo_sim.effects import EFFECTS, place, Placed
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.truth.drawing import of_size

VALUES = {
    'servo_stiffness': ('k', np.exp(np.outer([-1, 1], np.geomspace(0.01, 1.2, 20)).ravel())),
    'servo_damping': ('d', np.geomspace(1e-4, 0.3, 40)),
    'goal_rate': ('rate', np.geomspace(0.3, 300.0, 40)),
}
"""Parameter of each effect and the values of which one is drawn; of the second robot's damping 20
times as much, N m s/rad."""
SIZES, SECONDS, FINE = (2.0, 30.0), 8.0, 3.7e-4
LIMIT = 'limit: {value: 6, unit: N m}'
LOOP = (
    'limit: {value: 3, unit: rad}\n    stiffness: {value: 20, unit: N m/rad}\n'
    '    damping: {value: 1, unit: N m s/rad}\n    effort: {value: 6, unit: N m}'
)


def robots(folder: Path) -> list[Robot]:
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
    return [load_robot(known), load_robot(stiff)]


class Ahead:
    """Half a second ahead along a run without any effect, noise as floors; a `drawing.Sized`."""

    def __init__(self, run: Run) -> None:
        (scene,), self.robot, self._noise = run.scenes, run.robot, run.noise
        assert isinstance(scene, Given)
        self._period = run.robot.control_period
        steps, model = round(0.5 / self._period), Model(run.robot)
        start, inputs = model.start('nominal'), scene.inputs
        track = rollout(model, start.q[None], start.dq[None], inputs[None], self._period)
        self._inputs = inputs[: len(inputs) // steps * steps].reshape(-1, steps, inputs.shape[-1])
        self._begin = [x[0, :-1:steps][: len(self._inputs)] for x in track]
        self._ideal = self._run(())

    def size(self, placed: Placed) -> np.ndarray:
        both = zip(self._run((placed,)), self._ideal, self._noise, strict=True)
        changes = [(there - here)[..., -1, :] / noise for there, here, noise in both]
        return np.sqrt(np.mean(np.square(changes), axis=(0, -2, -1)))

    def _run(self, effects: tuple[Placed, ...]) -> tuple[np.ndarray, np.ndarray]:
        with np.errstate(all='ignore'):
            model = Model(self.robot, effects)
            return rollout(model, *self._begin, self._inputs, self._period)


def hidden(kind: str, run: Run, rng: np.random.Generator) -> tuple[Placed, float]:
    """An effect of a size drawn from `SIZES`, where it has one there, or near them."""
    ahead, robot = Ahead(run), run.robot
    while kind == 'old':
        name = str(rng.choice([n for n, e in EFFECTS.items() if n not in VALUES]))
        if not EFFECTS[name].applies(robot):
            continue
        places = EFFECTS[name].places(robot)
        where = 'all' if EFFECTS[name].late else str(rng.choice(places))
        if (placed := of_size(ahead, name, where, log_uniform(rng, SIZES), rng)) is not None:
            return placed, float(ahead.size(placed))
    name, values = VALUES[kind]
    values = values * (1.0 if robot.has_motor_law or kind != 'servo_damping' else 20.0)
    where = str(rng.choice(EFFECTS[kind].places(robot)))
    sizes = ahead.size(place(robot, kind, where, **{name: values[:, None, None]}))
    wanted = log_uniform(rng, SIZES)
    off = np.abs(np.log(np.maximum(sizes, 1e-9) / wanted))
    best = int(np.argmin(np.where(sizes > 0.5 * SIZES[0], off, np.inf)))
    return place(robot, kind, where, **{name: float(values[best])}), float(sizes[best])


def recorded(run: Run, effects: Sequence[Placed], rng: np.random.Generator) -> Recording:
    (scene,), robot = run.scenes, run.robot
    assert isinstance(scene, Given)
    model, period = Model(robot, effects, integration_step=FINE), robot.control_period
    start = model.start('nominal')
    states = rollout(model, start.q[None], start.dq[None], scene.inputs[None], period)
    q, dq = (
        x[0, :-1] + rng.normal(0.0, noise, x[0, :-1].shape)
        for x, noise in zip(states, run.noise, strict=True)
    )
    episode = Episode(period * np.arange(len(q)), q, dq, scene.inputs, scene.enabled)
    motors = tuple(a.joint for a in robot.actuators)
    known = '0' * 64, robot.joint_names, motors, robot.input, period, (episode,), {}
    return Recording(Path('log'), *known)


def searched(data: Recording, robot: Robot) -> tuple[list[list[str]], list[list[float]]]:
    """What is chosen, and the 95 % intervals of the first effect's parameters."""
    model = Model(robot)
    found = search([data], model, pose([data], [], model, SETTINGS))
    chosen = found.final.hypothesis.candidates
    first = range(len(chosen[0].parameters)) if chosen else ()
    intervals = [[float(end) for end in found.final.ci95(i)] for i in first]
    return [[c.effect.name, c.where] for c in chosen], intervals


def told(kind: str, seed: int, robot: Robot) -> dict[str, Any]:
    """One line: the truth and what was chosen."""
    rng = np.random.default_rng([seed, 77])
    noise = log_uniform(rng, (0.5e-3, 3e-3)), log_uniform(rng, (0.02, 0.1))
    run = Run(robot, (Given(*excitation(robot, rng, SECONDS)),), noise)
    truth, size = (None, 0.0) if kind == 'none' else hidden(kind, run, rng)
    data = recorded(run, [truth] if truth else [], rng)
    began = time.process_time()
    named, intervals = searched(data, robot)
    line = {'asked': kind, 'seed': seed, 'robot': robot.name, 'size': size, 'named': named}
    line['cpu_seconds'] = time.process_time() - began
    if truth is None:
        return {**line, 'right': not named}
    thing, facts = place_of(truth), Facts.of(robot, [data])
    line |= {'thing': list(thing), 'values': list(truth.parameters.values())}
    line['same'] = bool(named) and why_same(thing, tuple(named[0]), facts) is not None
    right = bool(named) and tuple(named[0]) == thing
    pairs = zip(line['values'], intervals, strict=True) if right else ()
    line['inside'] = [low <= value <= high for value, (low, high) in pairs]
    if kind == 'old':
        new = {name: EFFECTS.pop(name) for name in VALUES}
        line['before'] = searched(data, robot)[0]
        EFFECTS.update(new)
    return {**line, 'right': right or line['same'], 'alone': len(named) == 1}


def table(lines: Sequence[dict[str, Any]]) -> None:
    for kind in dict.fromkeys(line['asked'] for line in lines):
        for robot in ('xl330_pendulum', 'double_pendulum'):
            mine = [x for x in lines if x['asked'] == kind and x['robot'] == robot]
            held = [inside for x in mine for inside in x.get('inside', [])]
            right = sum(x['right'] for x in mine)
            print(f'{kind}, {robot}: right {right} of {len(mine)}; inside {sum(held)}', end='')
            print(f' of {len(held)}; alone {sum(x.get("alone", 0) for x in mine)}')
    old = [x for x in lines if x['asked'] == 'old']
    same = sum(x['named'] == x['before'] for x in old)
    print(f'the same before and after: {same} of {len(old)}')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('kinds', nargs='*', help=f'of {", ".join((*VALUES, "none", "old"))}')
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
                    print(line, flush=True)


if __name__ == '__main__':
    main()
