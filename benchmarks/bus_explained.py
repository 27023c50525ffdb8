# SPDX-License-Identifier: Apache-2.0
"""What is hidden in the emulated LEO, found from the bags that the hardware driver recorded.

    python benchmarks/bus_explained.py [--first-seed 1] [--cases 20] [-o FOLDER] [--record]

In each case an effect is drawn by the seed and hidden behind the servos' bytes. LEO hangs and
swings for 15 s, then walks by the shipped policy, both through the driver `dynamixel` in real time
and recorded by `leo bag record`; then both bags go to `leo explain`. Right is judged as in `leo
blind`. Every applied voltage in a bag is looked up in the bus's own record of what was on the
motors. --record leaves the explaining to a later call; what is there already is kept.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
import re
import subprocess
import time
from typing import Any

from emulated import Emulated, emulated, LEO, PATIENCE, real_time
import numpy as np
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter

from leo_lab.blind.judge import judge
from leo_msgs_py.bag_contents import load
from leo_msgs_py.cdr import decode
from leo_msgs_py.node import call, join, spin_until
from leo_msgs_py.values import nanoseconds
from leo_sim.description.robot import load_robot
from leo_sim.effects import EFFECTS
from leo_sim.verbs.reveal import read_sealed

ROBOT = load_robot('leo')
MOTIONS = (
    ('hanging', 'swinging', ('swinging', '--seconds', '15')),
    ('nominal', 'walking', ('leo_walk', '--episodes', '1')),
)
"""Start pose, bag, and what is played."""
WITHIN = '180s'
APPLIED = '/robot/applied_voltage'
FREE = 1e3
"""Stands for a free motor [V]."""
SLACK = 0.05
"""A voltage in the bag was on the motor within so long after its stamp [s]."""


def main() -> None:
    """Record, explain and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--first-seed', type=int, default=1)
    parser.add_argument('--cases', type=int, default=20)
    parser.add_argument('-o', '--output', type=Path, default=Path('bus_explained'))
    parser.add_argument('--record', action='store_true', help='do not explain yet')
    options = parser.parse_args()
    output = options.output.resolve()
    folders = [output / str(options.first_seed + n) for n in range(options.cases)]
    for folder in folders:
        if not (folder / 'recorded.json').exists():
            folder.mkdir(parents=True, exist_ok=True)
            record(folder, int(folder.name))
    if not options.record:
        rows = [explained(folder) for folder in folders]
        print(f'{sum(row["right"] for row in rows)} of {len(rows)} right')


def record(folder: Path, seed: int) -> None:
    """One robot, two bags."""
    sealed = folder / 'truth.sealed'
    with emulated('hanging', (f'hidden_seed:={seed}', f'sealed:={sealed}'), 2.0) as leo:
        offset = time.time() - time.monotonic()
        node = join(Node('bench'))
        for start, bag, words in MOTIONS:
            put_up(node, start)
            leo.start('recorder', 'bag', 'record', '-o', str(folder / bag))
            leo.start_robot(f'start:={start}', 'fault_periods:=100')
            assert spin_until(lambda: node.count_subscribers(APPLIED) > 0, PATIENCE), leo.said()
            real_time(leo.start('play', 'play', *words).pid)
            assert spin_until(lambda: not leo.runs('play'), PATIENCE + 60.0), leo.said()
            leo.stop('robot')
            leo.stop('recorder')
        found: dict[str, Any] = {bag: applied(folder / bag, leo, offset) for _, bag, _ in MOTIONS}
        found |= {
            'seed': seed,
            'bus_waited_s': round(leo.waited(0.0), 3),
            'lost': re.findall(r'\((\d+) so far\)', leo.said('robot'))[-1:],
            'said': leo.said('play').splitlines()[-1],
        }
    (folder / 'recorded.json').write_text(json.dumps(found) + '\n')
    print(found, flush=True)


def put_up(node: Node, start: str) -> None:
    """Somebody puts the robot into a start pose."""
    client = node.create_client(SetParameters, '/servo_bus/set_parameters')
    value = Parameter('start', value=start).to_parameter_msg()
    call(client, SetParameters.Request(parameters=[value]), PATIENCE)


def applied(bag: Path, leo: Emulated, offset: float) -> dict[str, Any]:
    """How far what a bag says was applied is from what was on the motors [V], at most."""
    topic = load(bag).topics[APPLIED]
    said = [decode(m.data, topic.type) for m in topic.messages]
    moments = leo.moments()
    times = np.array([t for t, _ in moments])
    volts = np.array([v for _, v in moments])
    off = []
    for message in said:
        at = nanoseconds(message.header.stamp) * 1e-9 - offset
        first, last = np.searchsorted(times, (at - SLACK, at + SLACK))
        near = volts[max(0, first - 1) : last + 1]
        there = np.nan_to_num(near, nan=FREE)
        off.append(np.abs(there - np.nan_to_num(message.effort, nan=FREE)).min(axis=0).max())
    return {
        'messages': len(said),
        'worst_v': round(float(np.max(off)), 6),
        'beyond_step': int(np.sum(np.array(off) > ROBOT.actuators[0].supply / 885)),
    }


def explained(folder: Path) -> dict[str, Any]:
    """The verdict on a case; asked for once."""
    answer = folder / 'explain' / 'explain.json'
    bags = [str(folder / bag) for _, bag, _ in MOTIONS if (folder / bag).exists()]
    if not answer.exists():
        subprocess.run(
            [
                LEO,
                'explain',
                *bags,
                '--model',
                'leo',
                '-o',
                str(answer.parent),
                '--within',
                WITHIN,
            ],
            check=False,
            stdout=subprocess.DEVNULL,
        )
    truth = true_case(folder)
    row = judge(truth, json.loads(answer.read_text()), ROBOT)
    print(
        folder.name,
        truth['effects'][0]['name'],
        truth['effects'][0]['where'],
        truth['effects'][0]['parameters'],
        row['verdict'],
        row['set'][:1],
        row['errors'],
        'right' if row['right'] else 'WRONG',
        f'{row["seconds"]:.0f} s',
        flush=True,
    )
    return row


def true_case(folder: Path) -> dict[str, Any]:
    """What was hidden, as `leo blind` says it."""
    effects = read_sealed(folder / 'truth.sealed')['effects']
    return {
        'kind': 'effect',
        'ever_free': False,
        'effects': [
            {
                **e,
                'family': EFFECTS[e['name']].family,
                'units': {p.name: p.unit for p in EFFECTS[e['name']].parameters},
                'parameters': {p: q['value'] for p, q in e['parameters'].items()},
                'neutral': {p.name: p.neutral for p in EFFECTS[e['name']].parameters},
            }
            for e in effects
        ],
    }


if __name__ == '__main__':
    main()
