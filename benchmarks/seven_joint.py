# SPDX-License-Identifier: Apache-2.0
"""A Panda-like arm of seven joints with smooth friction: what leo says, and what it takes.

    pip install -r requirements-mujoco.txt
    python benchmarks/seven_joint.py -o /tmp/arm7
    python benchmarks/seven_joint.py -o /tmp/arm7 --only-bag

The robot folder is benchmarks/rigs/panda: lengths of the modified DH table that Franka publishes
(0.333, 0.316, 0.384, 0.0825, 0.088 m), masses, centres of mass and inertias of Gaz, Cognetti,
Oliva, Robuffo Giordano and De Luca, 'Dynamic Identification of the Franka Emika Panda Robot With
Retrieval of Feasible Parameters Using Penalty-Based Optimization', RA-L 2019; joint limits of its
data sheet. MuJoCo is the real robot: the same arm at 0.1 ms with b dq + c tanh(dq / 0.03 rad/s) at
each joint, which no model is told. A controller tracks sums of sines for 21 s at 1 kHz with PD,
gravity and Coriolis torque; the measured torque is the input of the bag. The friction's c are of
the size that the paper gives, its b are our own.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from arm7 import driven, measured, noisy, Samples, write
import numpy as np

from leo_sim.description.robot import load_robot, Robot
from leo_sim.model import Model
from leo_sim.references.mjcf import tree, written

RIG = Path(__file__).parent / 'rigs/panda'
SECONDS, PERIOD, SUBSTEPS = 21.0, 1e-3, 10
VISCOUS = np.array([1.1, 0.9, 0.7, 0.8, 0.35, 0.25, 0.2])  # N m s/rad
COULOMB = np.array([0.55, 0.87, 0.64, 1.28, 0.84, 0.30, 0.56])  # N m
WIDTH = 0.03  # rad/s
NOISE = 2e-5, 2e-3, 0.02  # rad, rad/s, N m
BANDWIDTH, RATIO = 20.0, 0.7  # rad/s, damping ratio
SINES, FASTEST = 4, 0.6  # per joint; Hz
SWING = np.array([0.35, 0.3, 0.35, 0.3, 0.4, 0.4, 0.5])  # rad, standard deviation
SEED = 7
VERBS = ('check', 'compare', 'explain')


class Path7:
    """Sums of sines about the nominal pose that begin at rest."""

    def __init__(self, middle: np.ndarray, rng: np.random.Generator) -> None:
        self._middle, shape = middle, (SINES, len(middle))
        self._turn = 2 * np.pi * rng.uniform(0.05, FASTEST, shape)
        self._phase = rng.uniform(-np.pi, np.pi, shape)
        self._size = SWING * np.sqrt(2 / SINES)

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Wanted angles [rad] and rates [rad/s]; all of it fades in within 2 s."""
        ramp = min(t / 2, 1.0)
        share, slope = ramp**2 * (3 - 2 * ramp), 3 * ramp * (1 - ramp)
        angle = self._size * np.sin(self._turn * t + self._phase)
        rate = self._size * self._turn * np.cos(self._turn * t + self._phase)
        sums = angle.sum(axis=0), rate.sum(axis=0)
        return self._middle + share * sums[0], slope * sums[0] + share * sums[1]


def simulated(robot: Robot, seconds: float = SECONDS, seed: int = SEED) -> Samples:
    """The arm in MuJoCo under its controller, with friction and with measurement noise."""
    import mujoco

    model, rng = Model(robot), np.random.default_rng(seed)
    arm = mujoco.MjModel.from_xml_string(written(tree(robot, model.laws)))
    arm.opt.timestep, start = PERIOD / SUBSTEPS, model.start('nominal').q
    path = Path7(start, rng)
    inertia = np.diag(model.rigid.mass_and_bias(start, np.zeros_like(start))[0])
    stiff, damped = BANDWIDTH**2 * inertia, 2 * RATIO * BANDWIDTH * inertia

    def controller(k: int, data: Any) -> np.ndarray:
        wanted, faster = path.at(k * PERIOD)
        torque = stiff * (wanted - data.qpos) + damped * (faster - data.qvel) + data.qfrc_bias
        return np.clip(torque, -robot.limits, robot.limits)

    samples = driven(arm, start, controller, round(seconds / PERIOD), SUBSTEPS, friction)
    return noisy(samples, NOISE, rng)


def friction(rate: np.ndarray) -> np.ndarray:
    """Viscous and smooth Coulomb friction [N m] at rates [rad/s]."""
    return VISCOUS * rate + COULOMB * np.tanh(rate / WIDTH)


def main() -> None:
    """Write the bag where there is none yet, run the three verbs, print."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('-o', dest='output', type=Path, default=Path('/tmp/arm7'))
    parser.add_argument('--only-bag', action='store_true')
    parser.add_argument('--verbs', nargs='+', default=VERBS, choices=VERBS)
    parser.add_argument('--limit', type=float, default=1800.0, help='for each verb [s]')
    given = parser.parse_args()
    bag = given.output / 'bag'
    if not bag.exists():
        robot = load_robot(RIG)
        write(robot, simulated(robot), PERIOD, bag)
    print(f'bag {bag}, robot {RIG}; friction b = {VISCOUS} N m s/rad, c = {COULOMB} N m')
    if not given.only_bag:
        table(bag, given.verbs, given.limit)


def table(bag: Path, verbs: Sequence[str], limit: float) -> None:
    """One line per verb as soon as it is done, and then what each said."""
    texts = {}
    print(f'{"":10}{"exit":>6}{"wall [s]":>10}{"CPU [s]":>10}{"memory [MB]":>13}', flush=True)
    for verb in verbs:
        took, texts[verb] = measured(limit, verb, bag, '--model', RIG)
        print(
            f'{verb:10}{took.status:6d}{took.wall:10.1f}{took.processor:10.1f}{took.memory:13.0f}',
            flush=True,
        )
    for verb, said in texts.items():
        print(f'\nleo {verb}:\n{said.rstrip()}')


if __name__ == '__main__':
    main()
