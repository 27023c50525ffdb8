# SPDX-License-Identifier: Apache-2.0
"""Data sheets of servos that do not exist: how often a 95 % interval holds the true constant.

    python benchmarks/data_sheets.py [--seeds 1 21] [--lines sheets.jsonl]

Each seed draws a servo on the bench: the constants of servo_pendulum within their ranges, friction
by one of the laws, in half of them a delay. It does the standard motion in the integrator
Runge-Kutta 4, which no fit uses, and is measured as a driver does: 4096 counts a turn, rates with
noise. Seeds that the file of lines has are not run again.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import time

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.datasheet.measure import measure
from leo_diffmodel.datasheet.motion import motion
from leo_diffmodel.datasheet.settings import RUNGS
from leo_diffmodel.datasheet.sheet import sheet
from leo_lab.result_lines import append_result, read_results
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

ROBOT, JOINT = 'servo_pendulum', 'pivot'
COUNT = 2 * np.pi / 4096  # rad
RATE_NOISE = 0.03  # rad/s
TRUE_STEP = 0.002  # s
SIZES = {
    'viscous_friction': {'b': (0.002, 0.01)},
    'coulomb_friction': {'c': (0.01, 0.05)},
    'stribeck_friction': {'c': (0.01, 0.03), 'c_static': (0.05, 0.08), 'v_s': (0.1, 0.4)},
    'load_dependent_friction': {'mu': (0.1, 0.3)},
    'stribeck_load_friction': {'mu': (0.1, 0.2), 'mu_static': (0.3, 0.4), 'v_s': (0.1, 0.4)},
    'directional_load_friction': {'mu': (0.05, 0.1), 'mu_back': (0.2, 0.4)},
    'quadratic_load_friction': {'mu': (0.05, 0.15), 'mu2': (0.2, 0.5)},
    'quadratic_drag': {'d': (0.0005, 0.002)},
}
DELAY = (0.005, 0.02)  # s


def truth(seed: int) -> tuple[Model, str, dict[str, float]]:
    """The model of a servo, the name of its friction law, and every true value by name."""
    rng, model = np.random.default_rng(seed), load_model(ROBOT)
    robot, law = model.robot, RUNGS[seed % len(RUNGS)]
    names, rung = [], law
    while rung.effect:
        names.append(rung.effect)
        rung = next(r for r in RUNGS if r.name == rung.on)
    drawn = {n: {p: rng.uniform(*ends) for p, ends in SIZES[n].items()} for n in names}
    if rng.uniform() < 0.5:
        drawn['command_delay'] = {'delay': rng.uniform(*DELAY)}
    effects = [place(robot, name, (JOINT,), **values) for name, values in drawn.items()]
    constants = {
        path: rng.uniform(*(np.array(c.uncertain) @ [[0.8, 0.2], [0.2, 0.8]]))
        for path, c in robot.constants.items()
        if c.uncertain
    }
    values = {f'{n}:{JOINT} {p}': v for n, row in drawn.items() for p, v in row.items()}
    return (
        model.changed(effects=effects, constants=dict(model.constants) | constants),
        law.name,
        values | constants,
    )


def recorded(model: Model, seed: int) -> Recording:
    """The standard motion as a driver measures it."""
    rng, robot = np.random.default_rng([seed, 1]), model.robot
    reference, run = (
        Model(robot, model.effects, model.constants, 'rk4', TRUE_STEP),
        motion(model, JOINT),
    )
    state, rows = reference.start('nominal', rng), []
    for inputs, on in zip(run.inputs, run.enabled, strict=True):
        rows.append(np.concatenate(reference.sense(state)))
        state = reference.step(state, inputs, robot.control_period, enabled=np.array([on]))
    angle, rate = np.array(rows).T[:, :, None]
    t, q = robot.control_period * np.arange(run.count), COUNT * np.round(angle / COUNT)
    dq, on = rate + rng.normal(0, RATE_NOISE, rate.shape), run.enabled[:, None]
    episode = Episode(t, q, dq, run.inputs, on)
    path, period = Path(f'servo_{seed}'), robot.control_period
    return Recording(path, '0' * 64, (JOINT,), (JOINT,), robot.input, period, (episode,), {})


def line(seed: int) -> dict:
    """Measure one servo, and compare."""
    began = time.process_time()
    model, law, values = truth(seed)
    data = sheet(measure([recorded(model, seed)], load_model(ROBOT), JOINT))
    rows = dict(data['constants'])
    for row in [*data['friction']['effects'], *data['others']]:
        rows |= {f'{row["name"]}:{row["where"]} {n}': p for n, p in row['parameters'].items()}
    inside = {
        name: bool(rows[name]['ci95'][0] <= value <= rows[name]['ci95'][1])
        for name, value in values.items()
        if name in rows
    }
    return {
        'seed': seed,
        'law': law,
        'found': data['friction']['law'],
        'rivals': data['friction']['rivals'],
        'others': [row['name'] for row in data['others']],
        'delay': any('delay' in name for name in values),
        'inside': inside,
        'values': {n: (values.get(n), r['value'], *r['ci95']) for n, r in rows.items()},
        'chi2_ratio': data['error']['chi2_ratio'],
        'seconds': time.process_time() - began,
    }


def true_of(row: dict) -> list[tuple[float, float, float, float]]:
    """True value, value and interval of all that a servo has."""
    return [tuple(row['values'][name]) for name in row['inside']]


def main() -> None:
    """A line for each seed, then how often intervals hold and laws are right."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seeds', nargs=2, type=int, default=[1, 21], metavar=('FIRST', 'END'))
    parser.add_argument('--lines', type=Path, default=Path('data_sheets.jsonl'))
    options = parser.parse_args()
    done = {row['seed']: row for row in read_results(options.lines)}
    wanted = range(*options.seeds)
    for seed in (s for s in wanted if s not in done):
        done[seed] = line(seed)
        append_result(options.lines, done[seed])
        print(seed, done[seed]['law'], '->', done[seed]['found'], done[seed]['inside'], flush=True)
    rows = [done[seed] for seed in wanted]
    inside = [ok for row in rows for ok in row['inside'].values()]
    right = sum(row['law'] in (row['found'], *row['rivals']) for row in rows)
    print(f'{sum(inside)} of {len(inside)} intervals hold the true value')
    print(f'{right} of {len(rows)} laws chosen or not ruled out')
    widths = [(high - low) / abs(value) for row in rows for _, value, low, high in true_of(row)]
    seconds = sum(row['seconds'] for row in rows)
    print(f'median width {np.median(widths):.2%} of the value; {seconds:.0f} CPU seconds')


if __name__ == '__main__':
    main()
