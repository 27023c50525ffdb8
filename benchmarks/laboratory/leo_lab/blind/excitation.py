# SPDX-License-Identifier: Apache-2.0
"""What drives a blind case: random inputs and, on a servo, phases with the motor free."""

from __future__ import annotations

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.model import Model
from leo_sim.model.batch import rollout

Array = np.ndarray
SECONDS = 20.0
LEVELS = {'voltage': (0.4, 1.0), 'torque': (0.1, 0.4), 'position': (0.2, 0.6)}
KINDS = ('steps', 'sines', 'chirp', 'binary')
FASTEST, GENTLER = 30.0, 0.7
FREED = ('servo_pendulum',)
FREE_PHASES, FREE_SECONDS = (4, 8), (0.3, 1.2)


def excitation(
    robot: Robot, rng: np.random.Generator, seconds: float = SECONDS
) -> tuple[Array, Array]:
    """Random steps, a sum of sines, a chirp or a random binary signal at each actuator.

    Returns:
        inputs [V, N m or rad] of each control period, shape (N, A), and whether the motors are on.
    """
    time = np.arange(round(seconds / robot.control_period)) * robot.control_period
    level = rng.uniform(*LEVELS[robot.input])
    signals = [_signal(rng, time, str(rng.choice(KINDS))) for _ in robot.actuators]
    inputs = robot.limits * np.clip(level * np.stack(signals, axis=-1), -1.0, 1.0)
    while _fastest(robot, inputs) > FASTEST:
        inputs = GENTLER * inputs
    on = _phases(rng, time) if robot.name in FREED else np.ones(len(time), dtype=bool)
    return inputs, np.repeat(on[:, None], len(robot.actuators), axis=-1)


def _fastest(robot: Robot, inputs: Array) -> float:
    """The largest joint rate of the ideal robot in the run [rad/s]."""
    model = Model(robot)
    start = model.start('nominal')
    _, dq = rollout(model, start.q[None], start.dq[None], inputs[None], robot.control_period)
    return float(np.abs(np.nan_to_num(dq, nan=np.inf)).max())


def _phases(rng: np.random.Generator, time: Array) -> Array:
    on = np.ones(len(time), dtype=bool)
    for _ in range(rng.integers(*FREE_PHASES, endpoint=True)):
        begin = rng.uniform(1.0, time[-1])
        on[(time >= begin) & (time < begin + rng.uniform(*FREE_SECONDS))] = False
    return on


def _signal(rng: np.random.Generator, time: Array, kind: str) -> Array:
    if kind == 'sines':
        waves = [np.sin(2 * np.pi * rng.uniform(0.2, 3) * time + rng.uniform(0, 6)) for _ in 'abc']
        return np.sum(waves, axis=0) / 2
    if kind == 'chirp':
        low, high = rng.uniform(0.1, 0.4), rng.uniform(2, 4)
        phase = 2 * np.pi * (low * time + 0.5 * (high - low) / time[-1] * time**2)
        return np.sin(phase)
    hold = rng.uniform(0.1, 0.5)
    index = np.floor(time / hold).astype(int)
    values = rng.uniform(-1, 1, index[-1] + 1)
    return (np.sign(values) if kind == 'binary' else values)[index]
