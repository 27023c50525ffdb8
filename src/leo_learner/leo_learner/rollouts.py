# SPDX-License-Identifier: Apache-2.0
"""What a simulated robot did under a policy, kept as a recording or written as a bag."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.recording import Episode, Recording
from leo_learner.env import ModelEnv, Step
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.drivers.base import INTERFACES

Rows = list[tuple[np.ndarray, ...]]


class Rollouts(gymnasium.Wrapper):
    """Keeps true states and inputs of the episodes of a `ModelEnv`, however it is wrapped."""

    def __init__(self, env: gymnasium.Env) -> None:
        super().__init__(env)
        assert isinstance(env.unwrapped, ModelEnv)
        self.model_env = env.unwrapped
        self.episodes: list[Rows] = []
        self._pose = 'random'

    def reset(self, **options: Any) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin the next episode."""
        self._pose = (options.get('options') or {}).get('pose', 'random')
        answer = self.env.reset(**options)
        self.episodes.append([self._row(np.zeros(len(self.model_env.robot.limits)))])
        return answer

    def step(self, action: np.ndarray) -> Step:
        """Step, and note what happened."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        rows = self.episodes[-1]
        rows[-1] = (*rows[-1][:2], self.model_env.applied)
        rows.append(self._row(self.model_env.applied))
        return observation, float(reward), terminated, truncated, info

    def recording(self) -> Recording:
        """Everything so far."""
        robot, period = self.model_env.robot, self.model_env.robot.control_period
        return Recording(
            path=Path('in-process'),
            sha256='',
            joints=robot.joint_names,
            actuators=tuple(a.joint for a in robot.actuators),
            input=robot.input,
            command_period=period,
            metadata={},
            episodes=tuple(_episode(rows, period) for rows in self._whole()),
        )

    def write(self, folder: Path) -> None:
        """Move the episodes so far into a bag.

        Raises:
            UserError: none of them has two steps.
        """
        robot, period = self.model_env.robot, self.model_env.robot.control_period
        runs = [_run(_episode(rows, period), robot) for rows in self._whole()]
        if not runs:
            raise UserError(f'{folder}: no episode of two steps to write; drive for longer')
        held = robot.start_poses[self._pose].held
        facts = {'robot': robot.name, 'start': self._pose, 'held': str(held).lower()}
        write_runs(folder, runs, facts)
        self.episodes = []

    def _whole(self) -> list[Rows]:
        return [rows for rows in self.episodes if len(rows) > 2]

    def _row(self, inputs: np.ndarray) -> tuple[np.ndarray, ...]:
        return self.model_env.state.q, self.model_env.state.dq, inputs


def _episode(rows: Rows, period: float) -> Episode:
    q, dq, inputs = (np.array(column) for column in zip(*rows, strict=True))
    t = np.arange(len(q), dtype=np.float64) * period
    return Episode(t=t, q=q, dq=dq, inputs=inputs, enabled=np.ones(inputs.shape, bool))


def _run(episode: Episode, robot: Robot) -> Run:
    kind = INTERFACES[robot.input]
    inputs = {
        actuator.joint: {kind: episode.inputs[:, k]} for k, actuator in enumerate(robot.actuators)
    }
    return Run(episode.t, robot.joint_names, episode.q, episode.dq, inputs=inputs)
