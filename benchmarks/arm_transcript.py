# SPDX-License-Identifier: Apache-2.0
"""A teleoperated SO-101 on its bus, from the cable to MuJoCo: every command, its time, its answer.

    python benchmarks/arm_transcript.py [--first-seed 1] [--cases 20] [-o FOLDER] [--within 10min]

Each seed hides a payload in the gripper, dry friction at one joint and a delay behind the bytes
of an emulated Feetech bus. A leader arm is moved for a minute and logged at 30 Hz as LeRobot does:
the last states read, the goals sent. Then what a person would type is run, one command after the
other: the log is imported and explained, the motion that `leo next` proposes goes through the bus
with `leo play`, both are explained, and the repaired model is exported and checked in MuJoCo.
With `--simulated` the log comes from the model, integrated at half a millisecond and read in
counts, instead of a bus, and nothing is played. Commands and what they said are in
FOLDER/SEED/transcript.txt, answers and times in FOLDER/transcript.jsonl; a seed that has a line
there is not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from functools import partial
import json
from pathlib import Path
import shutil
import subprocess
import sys
import time
from typing import Any

from emulated import Emulated, emulated, LEO, PATIENCE
import numpy as np
from rclpy.node import Node
import yaml

from leo_lab.result_lines import append_result, read_results
from leo_msgs_py import topics
from leo_msgs_py.node import join, spin_once, spin_until
from leo_sim.description.robot import load_robot
from leo_sim.effects import place, Placed
from leo_sim.model import Model
from leo_sim.model.model_file import write_effects

sys.path.append(str(Path(__file__).parents[1]))

from tests.lerobot_data import write_lerobot

ROBOT = load_robot('so101')
RATE = 30.0  # Hz, as LeRobot records
HALF = 0.66  # rad: of the range of poses, about the middle
SLEW = 5.0  # rad/s, of the driver; the leader stays below: what was sent is what was done
FINE = 5e-4  # s
COUNT = 2 * np.pi / 4096  # rad


def hidden(seed: int) -> list[Placed]:
    """A payload, dry friction at one joint, and a delay."""
    rng = np.random.default_rng([seed, 7])
    joint = ROBOT.joint_names[rng.integers(1, 4)]
    return [
        place(ROBOT, 'link_mass', 'gripper_link', m=float(rng.uniform(0.15, 0.4))),
        place(ROBOT, 'coulomb_friction', joint, c=float(rng.uniform(0.1, 0.3))),
        place(ROBOT, 'command_delay', 'all', delay=float(rng.uniform(0.03, 0.08))),
    ]


def led(seed: int) -> Iterator[np.ndarray]:
    """Goals of a hand: smooth reaches between poses, with short rests."""
    rng, at = np.random.default_rng(seed), np.zeros(len(ROBOT.actuators))
    middle = ROBOT.bounds.mean(axis=0)
    while True:
        to = middle + HALF * rng.uniform(-1, 1, len(at))
        s = np.linspace(0, 1, round(RATE * rng.uniform(0.6, 1.6)))
        yield from at + (10 * s**3 - 15 * s**4 + 6 * s**5)[:, None] * (to - at)
        at = to
        yield from [at] * round(RATE * rng.uniform(0.1, 0.6))


def teleoperated(leo: Emulated, folder: Path, seed: int, seconds: float) -> None:
    """Lead the arm for so long; a LeRobot data set of degrees."""
    node, heard = join(Node('leader')), []
    kind, name, qos = topics.JOINT_STATES
    node.create_subscription(kind, name, lambda m: heard.append(m.position), qos)
    kind, name, qos = topics.COMMANDS['position']
    send = node.create_publisher(kind, name, qos)
    assert spin_until(lambda: bool(heard) and send.get_subscription_count(), PATIENCE), leo.said()
    rows, goals, begun = [], led(seed), time.monotonic()
    for number in range(round(seconds * RATE)):
        goal = next(goals)
        while time.monotonic() < begun + number / RATE:
            spin_once(0.002)
        rows.append((np.array(heard[-1]), goal))
        send.publish(kind(data=goal.tolist()))
    states, actions = (np.degrees(x) for x in zip(*rows, strict=True))
    write_lerobot(folder / 'lerobot', [(states, actions)], RATE, ROBOT.joint_names)
    node.destroy_node()


def simulated(truth: list[Placed], folder: Path, seed: int, seconds: float) -> None:
    """The same without a bus: the arm is a model, its encoders count."""
    model, goals, seen = Model(ROBOT, truth, integration_step=FINE), led(seed), []
    given, state = [next(goals) for _ in range(round(seconds * RATE))], model.start('nominal')
    for goal in given:
        seen.append(np.round(state.q / COUNT) * COUNT)
        state = model.step(state, goal, 1 / RATE)
    states, actions = np.degrees(seen), np.degrees(given)
    write_lerobot(folder / 'lerobot', [(states, actions)], RATE, ROBOT.joint_names)


class Transcript:
    """Commands as typed, what they said, and how long they took."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.seconds = folder, {}

    def leo(self, *words: str) -> None:
        """Run `leo WORDS` in the folder of the case."""
        begun = time.monotonic()
        done = subprocess.run(
            [LEO, *words], capture_output=True, text=True, cwd=self.folder, check=False
        )
        took = time.monotonic() - begun
        self.seconds[f'{len(self.seconds) + 1} {words[0]}'] = round(took, 1)
        with (self.folder / 'transcript.txt').open('a') as file:
            file.write(f'$ leo {" ".join(words)}\n{done.stdout}')
            file.write(f'{done.stderr}[status {done.returncode}, {took:.0f} s]\n\n')


def case(folder: Path, seed: int, options: argparse.Namespace) -> dict[str, Any]:
    """One arm from the cable to an exported model."""
    shutil.rmtree(folder, ignore_errors=True)  # of a run that was ended
    folder.mkdir(parents=True)
    truth, said = hidden(seed), Transcript(folder)
    secret = folder / 'hidden.yaml'
    secret.write_text(yaml.safe_dump({'effects': write_effects(truth)}))
    arm = partial(emulated, 'nominal', (f'hidden:={secret}',), robot='so101')
    if options.simulated:
        simulated(truth, folder, seed, options.seconds)
    else:
        with arm() as leo:
            port = str(leo.port)
            said.leo('check-driver', 'feetech', '--robot', 'so101', '--port', port)
            leo.start_robot('start:=nominal', f'slew:={SLEW}')
            teleoperated(leo, folder, seed, options.seconds)
    said.leo('import', 'lerobot', '--guess', '--model', 'so101', '-o', 'map.yaml')
    guess = folder / 'map.yaml'
    guess.write_text(guess.read_text().replace("unit: '?'", 'unit: deg'))
    said.leo('import', 'lerobot', '--map', 'map.yaml', '-o', 'led')
    given = ('--model', 'so101', '--within', options.within)
    said.leo('explain', 'led', *given, '-o', 'first')
    said.leo('next', 'led', '--model', 'so101', '--explain', 'first', '-o', 'next.csv')
    if (folder / 'next.csv').exists() and not options.simulated:
        with arm() as leo:
            leo.start_robot('start:=nominal', f'slew:={SLEW}')
            said.leo('play', 'next.csv', '--yes', '--bag', 'played')
    bags = [bag for bag in ('led', 'played') if (folder / bag).exists()]
    last = 'first'
    if len(bags) > 1:
        said.leo('explain', *bags, *given, '-o', 'both')
        last = 'both'
    row, model = judged(folder, truth, last), 'so101'
    if row[last]['effects']:
        model = 'repaired.yaml'
        said.leo('add', 'so101', '--from', f'{last}/explain.json', '-o', model)
    said.leo('export', model, '--to', 'mjcf', '-o', 'arm.xml', '--check', *bags)
    return {'seed': seed, 'seconds': said.seconds, **row}


def judged(folder: Path, truth: list[Placed], last: str) -> dict[str, Any]:
    """What was hidden, and what was named by the log alone and with the motion."""
    wanted = {(p.effect.name, tuple(p.where)) for p in truth}
    row: dict[str, Any] = {'hidden': {p.effect.name: dict(p.parameters) for p in truth}}
    for name in dict.fromkeys(('first', last)):
        file = folder / name / 'explain.json'
        found = json.loads(file.read_text()) if file.exists() else {'verdict': 'none'}
        effects = found.get('effects', [])
        named = {(e['name'], tuple(where_of(e['where']))) for e in effects}
        row[name] = {
            'verdict': found['verdict'],
            'effects': [[e['name'], e['where'], e['parameters']] for e in effects],
            'right': named == wanted,
        }
    return row


def where_of(where: str | list[str]) -> list[str]:
    """Names of joints or links."""
    names = [where] if isinstance(where, str) else where
    return list(ROBOT.joint_names) if names == ['all'] else names


def main() -> None:
    """Run the cases that are not there, and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--first-seed', type=int, default=1)
    parser.add_argument('--cases', type=int, default=20)
    parser.add_argument('--within', default='10min')
    parser.add_argument('--seconds', type=float, default=60.0, help='of the log')
    parser.add_argument('--simulated', action='store_true', help='a log without a bus')
    parser.add_argument('-o', '--output', type=Path, default=Path('arm_transcript'))
    options = parser.parse_args()
    output = options.output.resolve()
    lines = output / 'transcript.jsonl'
    rows = read_results(lines)
    done = {row['seed'] for row in rows}
    for seed in range(options.first_seed, options.first_seed + options.cases):
        if seed not in done:
            rows.append(case(output / str(seed), seed, options))
            append_result(lines, rows[-1])
            print(rows[-1], flush=True)
    right = [row['both' if 'both' in row else 'first']['right'] for row in rows]
    print(f'{sum(right)} of {len(right)} right')


if __name__ == '__main__':
    main()
