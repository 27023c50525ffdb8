# SPDX-License-Identifier: Apache-2.0
"""What a simulated robot did under a policy, kept as a recording or written as a bag."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import gymnasium
import numpy as np

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.difference.data import channel_names
from leo_diffmodel.difference.model import DifferenceModel
from leo_learner.env import ModelEnv, RobotSpaces, Step
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.drivers.base import INTERFACES

Rows = list[tuple[np.ndarray, ...]]
OUTSIDE = 0.5
"""A step is outside the data where less than this share of the correction is left."""


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
        robot = self.model_env.robot
        return Recording(
            path=Path('in-process'),
            sha256='',
            joints=robot.joint_names,
            actuators=tuple(a.joint for a in robot.actuators),
            input=robot.input,
            command_period=robot.control_period,
            metadata={},
            episodes=self._whole(),
        )

    def write(self, folder: Path) -> None:
        """Move the episodes so far into a bag.

        Raises:
            UserError: none of them has two steps.
        """
        robot = self.model_env.robot
        runs = [_run(episode, robot) for episode in self._whole()]
        if not runs:
            raise UserError(f'{folder}: no episode of two steps to write; drive for longer')
        held = robot.start_poses[self._pose].held
        facts = {'robot': robot.name, 'start': self._pose, 'held': str(held).lower()}
        write_runs(folder, runs, facts)
        self.episodes = []

    def _whole(self) -> tuple[Episode, ...]:
        """The episodes of two steps or more."""
        period = self.model_env.robot.control_period
        return tuple(_episode(rows, period) for rows in self.episodes if len(rows) > 2)

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


@dataclass(frozen=True)
class Left:
    """How one episode left the data.

    Attributes:
        seconds: from its start to the first step outside [s]; None where there is none.
        channel: what was furthest from the data then, as `left_knee rate`.
        share: of its steps that are outside.
    """

    seconds: float | None
    channel: str | None
    share: float

    def __str__(self) -> str:
        if self.seconds is None:
            return 'stayed within the data of the difference model'
        return (
            f'left the data of the difference model after {self.seconds:.2f} s, at '
            f'{self.channel}; {100 * self.share:.0f} % of its steps are outside'
        )


class WatchedEnv(gymnasium.Wrapper):
    """Keeps what a difference model that knows where its data end says of every step."""

    env: RobotSpaces

    def __init__(self, env: RobotSpaces, difference: DifferenceModel) -> None:
        super().__init__(env)
        assert difference.trust is not None
        self._difference = difference
        self._names = channel_names(env.robot, difference.config.form)
        self._episodes: list[list[tuple[float, int]]] = []

    def reset(self, **options: Any) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin the next episode."""
        self._episodes.append([])
        return self.env.reset(**options)

    def step(self, action: np.ndarray) -> Step:
        """Step, and note what the difference model says of it."""
        before = self.env.sensed
        answer = self.env.step(action)
        if 'lost' in answer[4]:
            self._episodes.pop()
            return cast(Step, answer)
        judged = self._difference.judge(before.q, before.dq, self.env.applied)
        assert judged.channel is not None
        self._episodes[-1].append((float(judged.factor), int(judged.channel)))
        return cast(Step, answer)

    def left(self) -> list[Left]:
        """How each episode so far left the data."""
        return [self._left(steps) for steps in self._episodes]

    def _left(self, steps: list[tuple[float, int]]) -> Left:
        outside = [k for k, (factor, _) in enumerate(steps) if factor < OUTSIDE]
        if not outside:
            return Left(None, None, 0.0)
        first = outside[0]
        return Left(
            round(first * self.env.robot.control_period, 6),
            self._names[steps[first][1]],
            len(outside) / len(steps),
        )
