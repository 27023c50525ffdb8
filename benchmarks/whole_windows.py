# SPDX-License-Identifier: Apache-2.0
"""Rollouts by whole windows beside those by sample periods: CPU time, side by side in one run."""

import time
from unittest import mock

import numpy as np

from leo_sim.description.robot import load_robot
from leo_sim.dynamics import whole_windows
from leo_sim.effects import place
from leo_sim.model import Model, rollout

ROUNDS, PERIOD, SAMPLES, STEP = 9, 0.01, 30, 0.0025
EFFECTS = {
    'nothing': (),
    'Coulomb friction': (('coulomb_friction', 'all', {'c': 0.001}),),
    'Stribeck friction': (
        ('stribeck_friction', 'all', {'c': 0.001, 'c_static': 0.002, 'v_s': 0.3}),
    ),
    'load-dependent friction': (('load_dependent_friction', 'all', {'mu': 0.05}),),
    'a delay of commands': (('command_delay', 'all', {'delay': 0.012}),),
    'rates that lag': (('velocity_lag', 'all', {'tau': 0.01}),),
    'play in the gear': (('backlash', 'all', {'gap': 0.01}),),
}
WIDTHS = (8, 60, 400)


def least(model: Model, count: int) -> tuple[float, np.ndarray]:
    """The least CPU time of several rollouts [s], and the angles."""
    rng, size = np.random.default_rng(1), (count, len(model.robot.joint_names))
    inputs = rng.uniform(-0.3, 0.3, (count, SAMPLES, len(model.robot.actuators)))
    given = 0.3 * rng.standard_normal(size), rng.standard_normal(size), inputs
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        angles = rollout(model, *given, PERIOD)[0]
        times.append(time.process_time() - start)
    return min(times), angles


def main() -> None:
    """Print one line for each robot, effect and number of windows."""
    for name in ('pendulum', 'double_pendulum'):
        robot = load_robot(name)
        for label, effects in EFFECTS.items():
            placed = [place(robot, effect, where, **v) for effect, where, v in effects]
            model = Model(robot, placed, integration_step=STEP)
            for count in WIDTHS:
                whole, mine = least(model, count)
                with mock.patch.object(whole_windows, 'possible', return_value=False):
                    each, its = least(model, count)
                apart = float(np.abs(mine - its).max())
                print(
                    f'{name}, {label}, {count} windows: {1e3 * whole:.2f} ms, by sample periods '
                    f'{1e3 * each:.2f} ms, {each / whole:.1f} times; {apart:.1e} rad apart'
                )


if __name__ == '__main__':
    main()
