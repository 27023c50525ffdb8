# SPDX-License-Identifier: Apache-2.0
"""Record a simulated robot that differs from its model, as a bag.

    python examples/record.py bags/friction coulomb_friction:pivot c=0.2 --seed 1

A robot of your own is recorded with `leo bag record`, or its logs come in with `leo import`.
"""

import argparse
from pathlib import Path

import numpy as np

from leo_diffmodel.add.patch import from_words
from leo_diffmodel.bags.arrays import Run, write_runs
from leo_sim.model import Model, rollout

DT, HOLD = 0.01, 0.3
"""Between two samples, and between two steps of the input [s]."""
NOISE = 1e-3, 0.05
"""Standard deviation of the measured angle [rad] and rate [rad/s]."""


def main() -> None:
    """Drive the robot with steps of random size and write what its sensors say."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('bag', type=Path)
    parser.add_argument('words', nargs='*', metavar='EFFECT[:WHERE] PARAM=VALUE')
    parser.add_argument('--robot', default='torque_pendulum')
    parser.add_argument('--seconds', type=float, default=10.0)
    parser.add_argument('--seed', type=int, default=1)
    asked = parser.parse_args()

    model, _ = from_words(Model(asked.robot, engine='rigid'), asked.words)
    t = DT * np.arange(round(asked.seconds / DT))
    (motor,) = model.robot.actuators
    steps = np.random.default_rng(asked.seed).uniform(-0.35, 0.35, int(t[-1] / HOLD) + 1)
    inputs = motor.limit * steps[(t / HOLD + 1e-9).astype(int)][:, None]

    start = model.start()
    q, dq = (
        each[0, : len(t)]
        for each in rollout(model, start.q[None], start.dq[None], inputs[None], DT)
    )
    rng = np.random.default_rng([asked.seed, 1])
    q, dq = q + rng.normal(0, NOISE[0], q.shape), dq + rng.normal(0, NOISE[1], dq.shape)

    interface = 'voltage' if model.robot.input == 'voltage' else 'effort'
    applied = {motor.joint: {interface: inputs[:, 0], 'enabled': np.ones(len(t))}}
    write_runs(asked.bag, [Run(t, model.robot.joint_names, q, dq, inputs=applied)], {})
    print(f'wrote {asked.bag}: {asked.seconds:g} s of {asked.robot}')


if __name__ == '__main__':
    main()
