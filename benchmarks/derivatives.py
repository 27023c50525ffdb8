# SPDX-License-Identifier: Apache-2.0
"""What a derivative of a rollout costs: motions near one, as shares of a rollout, in one run.

    python benchmarks/derivatives.py [ROBOT ...]

CPU time of windows with 1, 2 and 42 start states each, these by themselves or near the first.
"""

import sys
import time

import numpy as np

from leo_sim.description.robot import load_robot
from leo_sim.model import Model, rollout

ROBOTS = ('pendulum', 'double_pendulum', 'so101')
ROUNDS, WINDOWS, SAMPLES, PERIOD, MANY = 5, 20, 30, 0.01, 42


def least(model: Model, count: int, near: bool) -> float:
    """The least CPU time of several rollouts of so many start states in each window [s]."""
    rng, size = np.random.default_rng(0), (WINDOWS, len(model.robot.joint_names))
    inputs = 0.3 * rng.standard_normal((WINDOWS, SAMPLES, len(model.robot.actuators)))
    q, dq = 0.2 * rng.standard_normal(size), rng.standard_normal(size)
    starts = [x + 1e-6 * rng.standard_normal((count, *size)) for x in (q, dq)]
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        rollout(model, *starts, inputs, PERIOD, near=near)
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    """Print one line for each robot."""
    for name in sys.argv[1:] or ROBOTS:
        model = Model(load_robot(name))
        one, two, many = (least(model, n, near=True) for n in (1, 2, MANY))
        whole = (least(model, MANY, near=False) - one) / (MANY - 1)
        each = (many - two) / (MANY - 2)
        print(
            f'{name}: each derivative {each / whole:.2f} of a rollout, the slopes of the first '
            f'{(two - one - each) / whole:.2f}; {MANY} in {many / (MANY * whole):.2f} of the time'
        )


if __name__ == '__main__':
    main()
