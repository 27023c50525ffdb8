# SPDX-License-Identifier: Apache-2.0
"""SAPC's published cases, a simulated Franka FR3 with known changes: what leo says of them.

    pip install -r requirements-mujoco.txt
    python benchmarks/sapc.py -o /tmp/sapc                      # lines in /tmp/sapc/sapc.jsonl
    python benchmarks/sapc.py -o /tmp/sapc --cases none C2 --within 3min
    python benchmarks/sapc.py -o /tmp/sapc --input goals        # without torque

SAPC is Park, Lee, Park and Kim, 'Fidelity Is Not Identification: Structure-Aware Calibration of
Robot Digital Twins', 2026, https://github.com/RCILab/sapc. Robot, changes, paths, controller and
noise below are rebuilt from the figures of its research folder (fr3_twin.py, run_cases.py,
run_counterfactual.py, of 2026-09-25); the program is ours. They publish one main study of four
changes at once, seven more cases (C1 to C7; only C1 to C3 are a change of one thing) and a robot
without a change. Theirs without a change is a PhysX recording, ours is MuJoCo, as their others.

The real robot is MuJoCo at 0.5 ms with its own soft dry friction, tracking Fourier paths of 20 s
(seeds 1 to 3 to learn from, 11 and 12 held out) at 1 kHz under PD with the unchanged arm's inverse
dynamics as feed-forward. A bag has 100 Hz: angles rounded to 1e-4 rad, as theirs; rates with
2e-3 rad/s (they differentiate angles of 1 kHz, which is finer); torques with 0.05 N m at 1 kHz,
means of 10 ms. `--input goals` has no torque: the arm is a servo with the controller's gains, and
its goals hold the feed-forward.

What counts is what SAPC counts, a group: a link (mass, centre of mass, inertia; the hand is part
of link 7, as there), a joint (friction), the rotors. `right`: the groups named are the changed
ones. Motion: the end effector's rms error [mm] in replays under the same controller, of the arm
as given and of the repaired model in MuJoCo (what `leo export --to mjcf` writes), mean of the two
held-out paths. Edited: link 7 has nothing of what was named, and the robot no payload.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
import json
from pathlib import Path
from typing import Any

from arm7 import driven, measured, noisy, Samples, write
from fr3 import arm, CASES, Change, Fourier, KD, KP, PERIOD, RIG, SECONDS, servo, Tracking
import numpy as np
from rich.console import Console
from rich.table import Table
import yaml

from leo_lab.result_lines import append_result, read_results, Row
from leo_sim.description.robot import load_robot
from leo_sim.effects import EFFECTS
from leo_sim.kinematics.frames import Kinematics
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

LOGGED = 10  # periods of control a row of the log
LEARNED, HELD_OUT = (1, 2, 3), (11, 12)
NOISE, GRAIN = (1e-5, 2e-3), 1e-4  # rad, rad/s at 1 kHz; rad
TORQUE_NOISE = 0.05  # N m at 1 kHz
SETTINGS = 'input', 'paths', 'seconds', 'within', 'hard', 'torque_noise'  # of a line
PUBLISHED = (
    'SAPC, its main study: payload 0.794 of 0.8 kg; motion 14.43 -> 0.0296 mm; edited 0.099 mm',
    'dense least squares there: payload 0.130 kg; motion 0.0270 mm; edited 11.73 mm',
    'SAPC without a change: ten of ten empty (PhysX); C6: its groups exactly in all draws (v2)',
)


class Bench:
    """The arm as given, its paths and controllers, and where bags and answers go."""

    def __init__(self, folder: Path, hard: bool, torque_noise: float) -> None:
        self.folder, self._hard, robot = folder, hard, load_robot(RIG)
        self._noise = *NOISE, torque_noise
        self.given = Model(robot)
        self.robot, start = robot, self.given.start('nominal').q
        nominal = arm(self.given, Change(), real=False, hard=hard)
        self.tracking = {
            seed: Tracking(Fourier(seed, start), nominal, robot.limits)
            for seed in (*LEARNED, *HELD_OUT)
        }

    def run(self, made: Any, seed: int, model: Model | None = None) -> Samples:
        """A robot or a model along a path; outer forces are no part of an MJCF file."""
        tracking, substeps = self.tracking[seed], round(PERIOD / made.opt.timestep)
        bodies = model.laws.bodies if model else {}
        forces = {link: body.force for link, body in bodies.items() if any(body.force)}
        periods = round(SECONDS / PERIOD)
        return driven(made, tracking.start, tracking, periods, substeps, forces=forces)

    def replayed(self, model: Model, change: Change) -> float:
        """Rms error of the hand [mm] between a model and the robot with this change."""
        ours = arm(model, Change(), real=False, hard=self._hard)
        real = arm(self.given, change, real=True, hard=self._hard)
        runs = ((self.run(ours, seed, model), self.run(real, seed)) for seed in HELD_OUT)
        errors = [self.hand(said.q) - self.hand(true.q) for said, true in runs]
        return float(np.mean([1e3 * np.sqrt((e**2).sum(axis=1).mean()) for e in errors]))

    def hand(self, q: np.ndarray) -> np.ndarray:
        """Where the flange is [m]."""
        return Kinematics(self.robot.joints).frames(q)['hand'].origin

    def bag(self, name: str, seed: int, draw: int, goals: bool) -> Path:
        """The bag of a case, a path and a draw of noise; made where there is none yet."""
        kind = f'{"_goals" * goals}{"_hard" * self._hard}_{self._noise[2]:g}'
        bag = self.folder / f'{name}_{draw}{kind}/path{seed}'
        if not bag.exists():
            true = self.run(arm(self.given, CASES[name], real=True, hard=self._hard), seed)
            q, dq, torque = noisy(true, self._noise, np.random.default_rng((draw, seed)))
            inputs = self.tracking[seed].goals if goals else torque
            means = inputs.reshape(-1, LOGGED, inputs.shape[1]).mean(axis=1)
            logged = Samples((np.round(q / GRAIN) * GRAIN)[::LOGGED], dq[::LOGGED], means)
            robot = load_robot(self.model(goals))
            write(robot, logged, PERIOD * LOGGED, bag)
        return bag

    def model(self, goals: bool) -> Path:
        """The robot folder, with the noise of its torques.

        Of goals, which are exact: a servo of the same gains, as strong as the limits.
        """
        noise = 0.0 if goals else self._noise[2] / np.sqrt(LOGGED)
        folder = self.folder / f'fr3_{"goals" if goals else f"{noise:.4g}"}'
        if not folder.exists():
            folder.mkdir(parents=True)
            (folder / 'robot.urdf').write_text((RIG / 'robot.urdf').read_text())
            file = yaml.safe_load((RIG / 'robot.yaml').read_text())
            for sensor in file['sensors'].values():
                sensor['input_noise'] = float(noise)
            if goals:
                file |= {'input': 'position', 'integration_step': 1e-3}
                for actuator, kp, kd in zip(file['actuators'].values(), KP, KD, strict=True):
                    actuator |= servo(actuator['limit']['value'], float(kp), float(kd))
            (folder / 'robot.yaml').write_text(yaml.safe_dump(file))
        return folder


def groups_of(effects: Sequence[Row], joints: Sequence[str]) -> list[str]:
    """The groups that effects of explain.json belong to; of commands and sensors SAPC has none."""
    found: set[str] = set()
    for effect in effects:
        name, where = effect['name'], joints if effect['where'] == 'all' else [effect['where']]
        if name == 'armature':
            found.add('rotors')
        elif name in EFFECTS and EFFECTS[name].hook in ('command', 'sensor'):
            found.add(name)
        else:
            found |= {'link7' if of == 'hand' else of for of in where}
    return sorted(found)


def answer(bench: Bench, name: str, draw: int, given: argparse.Namespace) -> Row:
    """What leo says of a case, and how well the repaired model moves."""
    goals = given.input == 'goals'
    bags = [bench.bag(name, seed, draw, goals) for seed in LEARNED[: given.paths]]
    model, within = bench.model(goals), given.within
    settings = {k: getattr(given, k) for k in SETTINGS}
    out = bags[0].parent / '_'.join(['explain', *map(str, settings.values())])
    limited = ['--within', within] if within else []
    options = ['--model', model, '--json', '-o', out, '--to', given.seconds]
    took, said = measured(given.limit, 'explain', *bags, *options, *limited)
    row: Row = {'case': name, 'draw': draw, **settings}
    row |= {'truth': CASES[name].groups, **took._asdict()}
    if took.status not in (0, 1):
        return row | {'verdict': 'none', 'said': said.strip()[-300:], 'right': False}
    data = json.loads((out / 'explain.json').read_text())
    row |= {key: data[key] for key in ('verdict', 'sentence')}
    row['effects'] = [{k: e[k] for k in ('name', 'where', 'parameters')} for e in data['effects']]
    row['groups'] = groups_of(data['effects'], bench.robot.joint_names)
    row['right'] = row['groups'] == row['truth']
    return row | moved(bench, CASES[name], out, model)


def moved(bench: Bench, change: Change, out: Path, *model: object) -> Row:
    """Errors of the hand [mm]: as given, repaired, and with the payload taken off both."""
    row: Row = {'before': bench.replayed(bench.given, change), 'after': None, 'edited': None}
    (out / 'model.yaml').unlink(missing_ok=True)  # of a run whose line is gone
    options = '--from', out / 'explain.json', '-o', out / 'model.yaml'
    took, _ = measured(60, 'add', *model, *options)
    effects = () if took.status else load_model(out / 'model.yaml').effects
    row['after'] = bench.replayed(bench.given.changed(effects=effects), change)
    if change.payload:
        kept = [p for p in effects if not {'link7', 'hand'} & {*p.where}]
        off = replace(change, payload=None)
        row['edited'] = bench.replayed(bench.given.changed(effects=kept), off)
        row['edited_before'] = bench.replayed(bench.given, off)
    return row


def table(rows: Sequence[Row]) -> Table:
    """A line for each case."""
    made = Table(
        'case', 'input', 'truth', 'said', 'right', 'motion [mm]', 'edited [mm]', 'CPU [s]'
    )
    for row in rows:
        named = ', '.join(f'{e["name"]}:{e["where"]} {_values(e)}' for e in row.get('effects', ()))
        made.add_row(
            f'{row["case"]} {row["draw"]}',
            ', '.join([row['input'], *(k for k in ('payload', 'hard') if row.get(k))]),
            ', '.join(row['truth']) or 'nothing',
            f'{row["verdict"]}: {named}',
            'yes' if row['right'] else 'no',
            _mm(row.get('before'), row.get('after')),
            _mm(row.get('edited_before'), row.get('edited')),
            f'{row["processor"]:.0f}',
        )
    return made


def _values(effect: Row) -> str:
    return ' '.join(f'{k} {v["value"]:.4g}' for k, v in effect['parameters'].items())


def _mm(*errors: float | None) -> str:
    return '-' if None in errors else ' -> '.join(f'{e:.3g}' for e in errors if e is not None)


def main() -> None:
    """Run what has no line yet; print a table of all lines."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('-o', dest='output', type=Path, default=Path('/tmp/sapc'))
    parser.add_argument('--cases', nargs='*', default=list(CASES), choices=list(CASES))
    parser.add_argument('--draws', type=int, default=1, help='draws of noise')
    parser.add_argument('--paths', type=int, default=3, choices=(1, 2, 3), help='to learn from')
    parser.add_argument('--input', default='torque', choices=('torque', 'goals'))
    parser.add_argument(
        '--seconds', type=float, default=SECONDS, help='of each; its period is 10 s'
    )
    parser.add_argument('--hard', action='store_true', help="leo's hard dry friction, not theirs")
    parser.add_argument('--torque-noise', type=float, default=TORQUE_NOISE, help='[N m] at 1 kHz')
    parser.add_argument('--within', default='', help='of leo explain')
    parser.add_argument('--limit', type=float, default=3600.0, help='of leo explain [s]')
    given = parser.parse_args()
    lines, bench = given.output / 'sapc.jsonl', Bench(given.output, given.hard, given.torque_noise)
    keys = ('case', 'draw', *SETTINGS)
    usual = {k: parser.get_default(k) for k in SETTINGS}
    done = [tuple((usual | row)[k] for k in keys) for row in read_results(lines)]
    settings = tuple(getattr(given, k) for k in SETTINGS)
    for draw in range(given.draws):
        for name in given.cases:
            if (name, draw, *settings) not in done:
                append_result(lines, answer(bench, name, draw, given))
    rows = read_results(lines)
    Console(width=160).print(table(rows))
    print(f'{sum(r["right"] for r in rows)} of {len(rows)} right.', *PUBLISHED, sep='\n')


if __name__ == '__main__':
    main()
