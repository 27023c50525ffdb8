# SPDX-License-Identifier: Apache-2.0
"""Episodes as a recording or a bag, how they walked, and where they left a model's data."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import gymnasium
import numpy as np

from leo_diffmodel.bags.arrays import write_runs
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.difference.data import channel_names
from leo_diffmodel.difference.model import DifferenceModel
from leo_diffmodel.faults.mending import runs_of
from leo_learner.environment.env import ModelEnv, RobotSpaces, Step
from leo_learner.environment.walk import Walk, walked
from leo_msgs_py.errors import UserError
from leo_sim.kinematics.gait import Gait
from leo_sim.model import State

Rows = list[tuple[np.ndarray, ...]]
OUTSIDE = 0.5  # a step is outside the data where less than this share of the correction is left


class Rollouts(gymnasium.Wrapper):
    """Keeps true states and inputs of the episodes of a `ModelEnv`, however it is wrapped."""

    def __init__(self, env: gymnasium.Env) -> None:
        super().__init__(env)
        assert isinstance(env.unwrapped, ModelEnv)
        self.model_env = env.unwrapped
        self.episodes: list[Rows] = []
        self._pose = 'random'

    def reset(self, **options: Any) -> tuple[np.ndarray, dict[str, Any]]:
        self._pose = (options.get('options') or {}).get('pose', 'random')
        answer = self.env.reset(**options)
        self.episodes.append([self._row(np.zeros(len(self.model_env.robot.limits)))])
        return answer

    def step(self, action: np.ndarray) -> Step:
        observation, reward, terminated, truncated, info = self.env.step(action)
        rows = self.episodes[-1]
        rows[-1] = (*rows[-1][:2], self.model_env.applied)
        rows.append(self._row(self.model_env.applied))
        return observation, float(reward), terminated, truncated, info

    def recording(self) -> Recording:
        robot = self.model_env.robot
        return Recording(
            path=Path('in-process'),
            sha256='',
            joints=robot.joint_names,
            actuators=tuple(a.joint for a in robot.actuators),
            input=robot.input,
            command_period=robot.control_period,
            metadata={},
            episodes=tuple(
                _episode(rows, robot.control_period) for rows in self.episodes if len(rows) > 2
            ),
        )

    def write(self, folder: Path) -> None:
        robot = self.model_env.robot
        runs = runs_of(self.recording())
        if not runs:
            raise UserError(f'{folder}: no episode of two steps to write; drive for longer')
        held = robot.start_poses[self._pose].held
        facts = {'robot': robot.name, 'start': self._pose, 'held': str(held).lower()}
        write_runs(folder, runs, facts)
        self.episodes = []

    def _row(self, inputs: np.ndarray) -> tuple[np.ndarray, ...]:
        return self.model_env.state.q, self.model_env.state.dq, inputs


def _episode(rows: Rows, period: float) -> Episode:
    q, dq, inputs = (np.array(column) for column in zip(*rows, strict=True))
    t = np.arange(len(q), dtype=np.float64) * period
    return Episode(t=t, q=q, dq=dq, inputs=inputs, enabled=np.ones(inputs.shape, bool))


@dataclass(frozen=True)
class Left:
    seconds: float | None  # from its start to the first step outside [s]; None where none is
    channel: str | None  # what was furthest from the data then, as `left_knee rate`
    share: float  # of its steps that are outside

    def __str__(self) -> str:
        if self.seconds is None:
            return 'stayed within the data of the difference model'
        return (
            f'left the data of the difference model after {self.seconds:.2f} s, at '
            f'{self.channel}; {100 * self.share:.0f} % of its steps are outside'
        )


class Recorded(gymnasium.Wrapper):
    """Remembers the present episode, as it was sensed, for its `walk`.

    Of every episode it keeps what a difference model says of the steps, for `left`.
    """

    def __init__(self, env: gymnasium.Env, difference: DifferenceModel | None = None) -> None:
        super().__init__(env)
        assert isinstance(env.unwrapped, RobotSpaces)
        self._base, self._difference = env.unwrapped, difference
        self._states: list[State] = []
        self._inputs: list[np.ndarray] = []
        self._judged: list[list[tuple[float, int]]] = []

    def reset(self, **options: Any) -> tuple[np.ndarray, dict[str, Any]]:
        answer = self.env.reset(**options)
        self._states, self._inputs = [self._base.sensed], []
        self._judged.append([])
        return answer

    def step(self, action: np.ndarray) -> Step:
        answer = cast(Step, self.env.step(action))
        if 'lost' in answer[4]:
            self._judged.pop()
            return answer
        before = self._states[-1]
        self._states.append(self._base.sensed)
        self._inputs.append(self._base.applied)
        if self._difference is not None:
            judged = self._difference.judge(before.q, before.dq, self._base.applied)
            assert judged.channel is not None
            self._judged[-1].append((float(judged.factor), int(judged.channel)))
        return answer

    def walk(self) -> Walk:
        q, dq = np.array([(state.q, state.dq) for state in self._states]).swapaxes(0, 1)
        return walked(self._base.robot, q, dq, np.array(self._inputs))

    def com_path(self) -> np.ndarray:
        """X and z of the centre of mass at the start and after each step so far, m, (T + 1, 2)."""
        return np.asarray(Gait(self._base.robot).com(np.array([s.q for s in self._states])))

    def left(self) -> list[Left]:
        """How each episode left the data of a difference model that knows where they end."""
        return [self._left(steps) for steps in self._judged]

    def _left(self, steps: list[tuple[float, int]]) -> Left:
        assert self._difference is not None
        outside = [k for k, (factor, _) in enumerate(steps) if factor < OUTSIDE]
        if not outside:
            return Left(None, None, 0.0)
        robot, first = self._base.robot, outside[0]
        name = channel_names(robot, self._difference.config.form)[steps[first][1]]
        return Left(round(first * robot.control_period, 6), name, len(outside) / len(steps))
