# SPDX-License-Identifier: Apache-2.0
"""Recordings of simulated robots whose truth is known, in memory or as bags."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from tests.models import stepped

from leo_diffmodel.bags.arrays import write_runs
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.faults.mending import runs_of
from leo_sim.description.robot import load_robot, Robot
from leo_sim.description.robot_file import SensorFile
from leo_sim.effects import Placed
from leo_sim.model import Model
from leo_sim.model.batch import rollout

PENDULUM, TORQUE = load_robot('pendulum'), load_robot('torque_pendulum')
POSITION = load_robot('xl330_pendulum')
NOISE = (1e-3, 0.05)
DT = 0.01
LEVELS = {'voltage': 0.5, 'torque': 0.35, 'position': 0.35}


def steps(robot: Robot, seconds: float, seed: int, hold: float = 0.3) -> np.ndarray:
    """Steps of random size, the default excitation, shape (N, A)."""
    index = (np.arange(round(seconds / DT)) * DT / hold + 1e-9).astype(int)
    sizes = np.random.default_rng(seed).uniform(-1, 1, index[-1] + 1)
    return LEVELS[robot.input] * robot.actuators[0].limit * sizes[index][:, None]


def record(
    robot: Robot,
    *effects: Placed,
    seconds: float = 10.0,
    seed: int = 1,
    noise: tuple[float, float] = NOISE,
    inputs: np.ndarray | None = None,
    **physics: Any,
) -> Recording:
    """Run a robot with effects from its nominal pose, 100 Hz, and measure it with noise.

    `noise` is the standard deviation of angle [rad] and rate [rad/s]; `inputs` [V, N m or rad]
    have shape (N, A) and are `steps` by default. `physics` are `constants`, `engine` and
    `integration_step` of the model, `enabled` (N, A) and `push` (N, J) of the run.
    """
    inputs = steps(robot, seconds, seed) if inputs is None else inputs
    enabled, push = physics.pop('enabled', None), physics.pop('push', None)
    model = Model(robot, effects, **{'engine': 'rigid', **physics})
    q, dq = (
        stepped(model, inputs, DT)
        if model.engine == 'rk4'
        else _rolled(model, inputs, enabled, push)
    )
    count, rng = len(inputs), np.random.default_rng([seed, 1])
    q = q[:count] + rng.normal(0, noise[0], q[:count].shape)
    dq = dq[:count] + rng.normal(0, noise[1], dq[:count].shape)
    on = np.ones(inputs.shape, dtype=bool) if enabled is None else enabled
    episode = Episode(DT * np.arange(count), q, dq, inputs, on)
    return of_robot(robot, episode, name=f'simulated_{seed}')


def of_robot(
    robot: Robot, *episodes: Episode, name: str = 'log', period: float = DT, **more: Any
) -> Recording:
    """A recording of a robot; `more` are its metadata, and further fields."""
    names = tuple(robot.joint_names), tuple(a.joint for a in robot.actuators)
    known = '0' * 64, *names, robot.input, period, episodes, more.pop('metadata', {})
    return Recording(Path(name), *known, **more)


def measured_torque(noise: float, recording: Recording) -> tuple[Robot, Recording]:
    """The torque pendulum that says how noisy its torque is [N m], and the run so measured."""
    rng = np.random.default_rng(5)
    episodes = [
        replace(e, inputs=e.inputs + noise * rng.standard_normal(e.inputs.shape))
        for e in recording.episodes
    ]
    sensor = SensorFile(input_noise=noise)
    return replace(TORQUE, sensors={'pivot': sensor}), replace(recording, episodes=(*episodes,))


def rounded(recording: Recording, seed: int = 0) -> Recording:
    """The same run as another processor might have rounded it: moved by 1e-12 of its size."""
    rng = np.random.default_rng(seed)
    moved = tuple(
        replace(
            e,
            **{
                name: x * (1 + 1e-12 * rng.standard_normal(x.shape))
                for name, x in (('q', e.q), ('dq', e.dq), ('inputs', e.inputs))
            },
        )
        for e in recording.episodes
    )
    return replace(recording, episodes=moved)


def bag(folder: Path, recording: Recording) -> Path:
    """Write a recording as a rosbag2 folder."""
    return write_runs(folder, runs_of(recording), {})


def _rolled(model: Model, inputs: np.ndarray, enabled: Any, push: Any) -> tuple[Any, Any]:
    start = model.start('nominal')
    batch = [None if x is None else x[None] for x in (enabled, push)]
    q, dq = rollout(
        model, start.q[None], start.dq[None], inputs[None], DT, enabled=batch[0], push=batch[1]
    )
    return q[0], dq[0]
