# SPDX-License-Identifier: Apache-2.0
"""Whether a recorder beside a robot in lockstep loses anything: the main job's rollout, again.

    python benchmarks/lossless.py [--runs 20] [--transitions 1000]

Each run starts a robot that hides something, a recorder and a policy that drives the robot for
`--transitions` control periods, as `leo demo` does. The robot says when it ends how many states it
sent; one that was lost leaves a gap, too: within an episode stamps are one state period apart,
over a reset one control period. Every state but the last of an episode has an input.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import re
import tempfile

import numpy as np

from leo_diffmodel.bags.contents import load
from leo_learner.processes import Processes
from leo_msgs_py.cdr import decode
from leo_msgs_py.values import nanoseconds
from leo_sim.description.robot import load_robot

ROBOT = load_robot('pendulum')
STATE_NS = round(1e9 / ROBOT.state_rate)
CONTROL_NS = round(1e9 * ROBOT.control_period)
TOPICS = {'states': '/joint_states', 'inputs': '/robot/applied_voltage'}


def stamps(bag: Path, topic: str) -> np.ndarray:
    """Stamps of a topic without repeats [ns]."""
    kept = load(bag).topics[topic]
    return np.unique([nanoseconds(decode(m.data, kept.type).header.stamp) for m in kept.messages])


def lost(bag: Path, sent: int) -> dict[str, int]:
    """How many states and inputs of those sent are missing."""
    at = {name: stamps(bag, topic) for name, topic in TOPICS.items()}
    gaps = np.diff(at['states'])
    resets = np.count_nonzero(gaps == CONTROL_NS)
    odd = np.count_nonzero((gaps != STATE_NS) & (gaps != CONTROL_NS))
    return {
        'sent': sent,
        'episodes': int(resets) + 1,
        'odd gaps': int(odd),
        'states lost': sent - at['states'].size,
        'inputs lost': sent - int(resets) - 1 - at['inputs'].size,
    }


def run(folder: Path, seed: int, policy: Path, transitions: int) -> dict[str, int]:
    """One rollout."""
    with Processes(folder / 'logs') as processes:
        processes.node(
            'robot',
            'leo_sim',
            'robot',
            robot='pendulum',
            realtime_factor=0,
            seed=seed,
            start='random',
            hidden_seed=seed,
            sealed=str(folder / 'sealed'),
        )
        processes.node('diffmodel', 'leo_diffmodel', 'diffmodel', bag=str(folder / 'rollout'))
        processes.wait_for(folder / 'rollout', 'diffmodel')
        processes.ask('play', str(policy), '--collect', str(transitions))
        processes.stop('diffmodel')
        processes.stop('robot')
    said = (folder / 'logs' / 'robot.log').read_text()
    return lost(folder / 'rollout', int(re.findall(r'(\d+) states sent', said)[0]))


def main() -> int:
    """Run and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--runs', type=int, default=20)
    parser.add_argument('--transitions', type=int, default=1000)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, Processes(Path(name, 'logs')) as processes:
        os.environ['XDG_RUNTIME_DIR'] = name
        policy = Path(name, 'ideal', 'policy.safetensors')
        processes.ask('learn', '--robot', 'pendulum', '--steps', '2000', '-o', str(policy.parent))
        rows = []
        for seed in range(options.runs):
            rows.append(run(Path(name, f'run{seed}'), seed, policy, options.transitions))
            print(seed, rows[-1], flush=True)
    print({key: sum(row[key] for row in rows) for key in rows[0]})
    return int(any(row['states lost'] or row['inputs lost'] or row['odd gaps'] for row in rows))


if __name__ == '__main__':
    raise SystemExit(main())
