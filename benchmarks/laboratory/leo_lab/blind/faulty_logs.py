# SPDX-License-Identifier: Apache-2.0
"""Faults of logs, drawn by seed and hidden in simulated bags: are they found, and how large?

    python benchmarks/log_faults.py --first-seed 1000 --cases 60 --clean 40 -o out/faults.jsonl
    python benchmarks/log_faults.py --first-seed 1000 --cases 60 -o out/faults.jsonl --mend

A case is a robot, a random run, noise or an encoder's counts, in half of the cases a physical
effect of 1 to 10 times its usual small size, and one fault of a size from one to thirty times
what just shows (`SIZES`). The run is simulated at 1 kHz, spoilt there and then sampled, so that a
late channel is late and not smoothed. `--mend` also asks `leo explain --mend` for the effect. One
line per case is appended to the results; cases that are there are not run again. Seeds below
50000 are for development.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
import tempfile
import time

import numpy as np

from leo_diffmodel.bags.arrays import write_runs
from leo_diffmodel.bags.recording import Episode, read_bag, Recording
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.find import find_faults
from leo_diffmodel.faults.mending import runs_of
from leo_lab.result_lines import append_result, read_results
from leo_lab.workers import Workers
from leo_sim.description.robot import load_robot, Robot
from leo_sim.effects import place, Placed
from leo_sim.model import Model
from leo_sim.model.batch import rollout

FINE = 0.001
"""s: step of the simulation."""
SLOWEST = 0.01
"""s: largest period of a log; inputs change at its multiples, as they do where one node sends
them and writes the log. A servo's goal that changes within a row is not the mean of the two."""
ROBOTS = {
    'pendulum': 0.5,
    'torque_pendulum': 0.3,
    'servo_pendulum': 0.5,
    'double_pendulum': 0.06,
    'xl330_pendulum': 0.4,
}
"""Share of the largest input that runs use."""
EFFECTS = {'viscous_friction': 'b', 'coulomb_friction': 'c', 'armature': 'J'}
"""Effects beside a fault, and the parameter that scales each."""
TAKEN_UP = ('viscous_friction', 'armature')
"""Effects that uncertain constants of a motor do as well: none is missing then."""
SECONDS = 20.0
SIZES = {
    'speed_scale': lambda m, run: (1 + 0.04 * m) ** run.sign,
    'speed_sign': lambda m, run: -1.0,
    'speed_zero': lambda m, run: run.sign * 0.025 * m * run.speed,
    'speed_late': lambda m, run: m * max(0.003, 0.7 * run.period),
    'speed_filter': lambda m, run: m * max(0.003, 0.7 * run.period),
    'angle_scale': lambda m, run: (180 / np.pi) if m > 5 else 1.3 + 0.3 * m,
    'time_stretch': lambda m, run: (1.25 + 0.02 * m) ** run.sign,
    'input_scale': lambda m, run: (8.0 + m) ** run.sign,
    'input_sign': lambda m, run: -1.0,
    'input_late': lambda m, run: 0.15 + 0.005 * m if run.sign > 0 else -0.08 - 0.005 * m,
    'angle_zero': lambda m, run: run.sign * min(1.2 + 0.1 * m, np.pi),
    'frozen': lambda m, run: 0.15 + 0.05 * m,
    'clipped': lambda m, run: run.speed * max(1.3 - 0.02 * m, 0.7),
    'repeated': lambda m, run: min(0.06 + 0.02 * m, 0.6),
    'quantised': lambda m, run: min(0.03 + 0.01 * m, 0.08) * min(run.span, 3.0),
    'goal_as_angle': lambda m, run: 1.0,
}
"""Size of each fault from its multiple m of what just shows, 1 to 30."""
OF_TORQUES = (
    'angle_zero',
    'input_scale',
    'input_sign',
    'input_late',
    'angle_scale',
    'time_stretch',
)
"""Not drawn for robots that take positions: their servo's torque is not logged."""
OF_SENSORS = ('repeated', 'quantised', 'frozen', 'clipped', 'goal_as_angle')
"""They come after the noise."""
COUNT = 2 * np.pi / 4096
"""rad: of an encoder of 12 bits."""


@dataclass(frozen=True)
class Drawn:
    """What a run is like: period [s], rms speed [rad/s], range [rad], and a sign to draw with."""

    period: float
    speed: float
    span: float
    sign: float


def main() -> None:
    """Run what is asked for and is not there yet, then print the rates."""
    options = _parser().parse_args()
    done = {(r['kind'], r['seed']) for r in read_results(options.output)}
    first = options.first_seed
    tasks = [('fault', s) for s in range(first, first + options.cases)]
    tasks += [('clean', s) for s in range(first, first + options.clean)]
    todo = [t for t in tasks if t not in done]
    began = time.monotonic()
    answers = Workers(options.jobs).each(partial(answered, mend=options.mend), todo)
    for number, row in enumerate(answers, start=1):
        append_result(options.output, row)
        spent = time.monotonic() - began
        left = spent / number * (len(todo) - number)
        print(f'{number} of {len(todo)}, about {left / 60:.0f} min left', flush=True)
    wanted = set(tasks)
    show([r for r in read_results(options.output) if (r['kind'], r['seed']) in wanted])


def answered(task: tuple[str, int], mend: bool) -> dict:
    """Draw one case, look for its fault and judge what was found."""
    kind, seed = task
    rng = np.random.default_rng([seed, kind == 'fault'])
    robot = load_robot(str(rng.choice([*ROBOTS])))
    effect = _effect(robot, rng)
    clean, period = _run(robot, effect, rng)
    name, value, log = (
        ('', 0.0, _measured(clean, period, rng))
        if kind == 'clean'
        else _spoilt(clean, robot, period, rng)
    )
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        bag = write_runs(Path(folder) / 'bag', runs_of(log), {})
        recording = read_bag(bag, robot)
        found = find_faults([recording], Model(robot))
        row = {
            'kind': kind,
            'seed': seed,
            'robot': robot.name,
            'fault': name,
            'value': value,
            'effect': effect.effect.name if effect else '',
            'period': period,
            'cpu': time.process_time() - began,
            'found': [
                {k: f.to_json()[k] for k in ('name', 'value', 'ci95', 'sure')}
                | {'worst': f.worst, 'otherwise': len(f.otherwise)}
                for f in found
            ],
            'read': [w.split(': ', 1)[-1] for w in recording.warnings],
        }
        if mend and effect is not None:
            row['named'] = _named(recording, robot)
    return row


def show(rows: list[dict]) -> None:
    """Rates by fault, then of all."""
    by = {}
    for row in (r for r in rows if r['kind'] == 'fault'):
        by.setdefault(row['fault'], []).append(row)
    for name, cases in sorted(by.items()):
        first = sum(map(_first, cases))
        inside = [r for r in (_inside(c) for c in cases) if r is not None]
        print(
            f'{name:15} first {first:3} of {len(cases):3}; '
            f'in its interval {sum(inside)} of {len(inside)}'
        )
    faulty = [r for cases in by.values() for r in cases]
    inside = [r for r in map(_inside, faulty) if r is not None]
    print(
        f'all: first {sum(map(_first, faulty))} of {len(faulty)}, in its interval '
        f'{sum(inside)} of {len(inside)}'
    )
    false = [r for r in rows if r['kind'] == 'clean' and any(f['sure'] for f in r['found'])]
    print(f'clean: {len(false)} false errors in {sum(r["kind"] == "clean" for r in rows)}')
    named = [r for r in rows if 'named' in r]
    right = sum(r['effect'] in r['named'] for r in named)
    alone = sum(r['named'] == [r['effect']] for r in named)
    print(f'effects after mending: {right} of {len(named)} right, {alone} of these by itself')


def _first(row: dict) -> bool:
    """Whether the first that is told, errors before warnings, is the fault."""
    return bool(row['found']) and row['found'][0]['name'] == row['fault']


def _inside(row: dict) -> bool | None:
    """Whether the interval holds the size, where the fault has one and is found."""
    mine = next((f for f in row['found'] if f['name'] == row['fault']), None)
    if mine is None or mine['ci95'][0] == mine['ci95'][1] or row['fault'].endswith('sign'):
        return None
    low, high = (mine['ci95'][i] + s * mine['worst'] for i, s in ((0, -1), (1, 1)))
    turn = 2 * np.pi if row['fault'] == 'angle_zero' else 0.0
    return any(low <= row['value'] + n * turn <= high for n in (-1, 0, 1))


def _effect(robot: Robot, rng: np.random.Generator) -> Placed | None:
    if rng.uniform() < 0.5:
        return None
    vague = any(c.uncertain for c in robot.constants.values())
    name = str(rng.choice([e for e in EFFECTS if not (vague and e in TAKEN_UP)]))
    joint = robot.actuators[0]
    usual = {'viscous_friction': 0.02, 'coulomb_friction': 0.03, 'armature': 0.0}[name]
    reach = joint.torque_constant or 1.0
    strong = {
        'voltage': joint.limit * reach / (joint.resistance or 1.0),
        'torque': joint.limit,
        'position': 0.5,
    }[robot.input]
    size = usual * strong * rng.uniform(1, 4)
    if name == 'armature':
        size = 0.15 * strong / 30.0 * rng.uniform(0.5, 1)
    return place(robot, name, joint.joint, **{EFFECTS[name]: size})


def _run(robot: Robot, effect: Placed | None, rng: np.random.Generator) -> tuple[Recording, float]:
    """A run at 1 kHz without noise, and the period it will be sampled with."""
    count, period = round(SECONDS / FINE), float(rng.choice([0.005, SLOWEST]))
    hold = round(rng.uniform(0.15, 0.5) / SLOWEST) * round(SLOWEST / FINE)
    level = ROBOTS[robot.name] * np.array([a.limit for a in robot.actuators])
    index = np.arange(count) // hold
    u = (level * rng.uniform(-1, 1, (index[-1] + 1, len(level))))[index]
    model = Model(robot, (effect,) if effect else ())
    start = model.start('nominal')
    q, dq = rollout(model, start.q[None], start.dq[None], u[None], FINE)
    e = Episode(
        FINE * np.arange(count), q[0][:count], dq[0][:count], u, np.ones(u.shape, dtype=bool)
    )
    names = tuple(robot.joint_names), tuple(a.joint for a in robot.actuators)
    return Recording(Path('simulated'), '', *names, robot.input, period, (e,), {}), period


def _spoilt(
    clean: Recording, robot: Robot, period: float, rng: np.random.Generator
) -> tuple[str, float, Recording]:
    """The run with one fault of its first actuated joint."""
    joint = clean.joints.index(clean.actuators[0])
    e = clean.episodes[0]
    run = Drawn(
        period,
        float(e.dq[:, joint].std()),
        float(np.ptp(e.q[:, joint])),
        float(rng.choice([-1, 1])),
    )
    names = [
        n
        for n in SIZES
        if (n == 'goal_as_angle') <= (robot.input == 'position')
        and not (robot.input == 'position' and n in OF_TORQUES)
    ]
    name = str(rng.choice(names))
    value = float(SIZES[name](float(np.exp(rng.uniform(0, np.log(30)))), run))
    base = _measured(clean, period, rng) if name in OF_SENSORS else clean
    spoilt = FAULTS[name].spoil(base.episodes[0], joint, 0, value)
    spoilt = replace(base, episodes=(spoilt,))
    return name, value, spoilt if name in OF_SENSORS else _measured(spoilt, period, rng)


def _sampled(recording: Recording, period: float) -> Recording:
    """Every so many rows of a run at 1 kHz; inputs as means over the rows left out."""
    (e,) = recording.episodes
    every = round(period / FINE)
    if len(e.t) < SECONDS / FINE * 0.9:
        return recording
    count = len(e.t) // every
    inputs = e.inputs[: count * every].reshape(count, every, -1).mean(axis=1)
    rows = slice(0, count * every, every)
    return replace(
        recording, episodes=(Episode(e.t[rows], e.q[rows], e.dq[rows], inputs, e.enabled[rows]),)
    )


def _measured(recording: Recording, period: float, rng: np.random.Generator) -> Recording:
    """Sampled, with noise, in a third of the cases with an encoder of 12 bits as well."""
    sampled = _sampled(recording, period)
    (e,) = sampled.episodes
    kind = int(rng.integers(3))
    noise = [(1e-3, 0.05), (4e-4, 0.01), (1e-4, 0.02)][kind]
    q = e.q + rng.normal(0, noise[0], e.q.shape)
    q = COUNT * np.round(q / COUNT) if kind == 2 else q
    dq = e.dq + rng.normal(0, noise[1], e.dq.shape)
    return replace(sampled, episodes=(replace(e, q=q, dq=dq),))


def _named(recording: Recording, robot: Robot) -> list[str]:
    """The effects that `leo explain --mend` names."""
    return [e['name'] for e in explain([recording], Model(robot), mend=True).effects]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('--first-seed', type=int, default=1000)
    parser.add_argument('--cases', type=int, default=0, help='with a fault')
    parser.add_argument('--clean', type=int, default=0, help='without any')
    parser.add_argument('--mend', action='store_true', help='explain those with an effect, too')
    parser.add_argument('--jobs', type=int, default=1)
    parser.add_argument('-o', dest='output', type=Path, default=Path('out/faults.jsonl'))
    return parser


if __name__ == '__main__':
    main()
