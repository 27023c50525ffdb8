# SPDX-License-Identifier: Apache-2.0
"""The model of a robot as a gymnasium environment, corrected by a difference model if given."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np

from leo_diffmodel.difference.network import DifferenceModel, from_bytes
from leo_msgs_py.errors import UserError
from leo_sim.model import Model, State
from leo_sim.robot import Robot
from leo_sim.task import Memory, Task

Step = tuple[np.ndarray, float, bool, bool, dict[str, Any]]


class RobotSpaces(gymnasium.Env[np.ndarray, np.ndarray]):
    """What every environment of a robot shares: spaces, length of an episode, reward.

    Observations are those of robot.yaml; actions are held inputs [V or N m] in actuator order.

    Attributes:
        sensed: the latest state as the sensors read it; set by `reset` and `step`.
        applied: the inputs of the latest step after the limits [V or N m], (A,).
    """

    sensed: State
    applied: np.ndarray

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.episode_steps = round(robot.episode_seconds / robot.control_period)
        size = len(robot.observation) or 2 * len(robot.joint_names)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float64)
        self.action_space = gymnasium.spaces.Box(-robot.limits, robot.limits, dtype=np.float64)
        self._task = Task(robot)

    def _begin(self, start: State) -> np.ndarray:
        """The observation at the start of an episode."""
        self._steps, self._memory, self.sensed = 0, Memory(), start
        return self._task.observation(start.q, start.dq)

    def _outcome(self, before: State, inputs: np.ndarray, after: State) -> Step:
        """Observation, reward and end of the step from one sensed state to the next."""
        self._steps += 1
        self.sensed, self.applied = after, inputs
        reward, self._memory = self._task.reward(self._memory, before, inputs, after)
        return (
            self._task.observation(after.q, after.dq),
            float(reward),
            bool(self._task.terminated(after)),
            self._steps >= self.episode_steps,
            {},
        )


class ModelEnv(RobotSpaces):
    """Episodes on `Model.step`; s' <- s'_model + d(s, a) becomes the state of the next step.

    Observation, reward and termination come from the corrected state as the sensors read it.

    Args:
        model: with its effects.
        difference: a difference model of the same robot.
    """

    def __init__(self, model: Model, difference: DifferenceModel | None = None) -> None:
        super().__init__(model.robot)
        self.model, self.difference = model, difference
        self.state = model.start()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode; `options={'pose': ...}` names a start pose, `random` without it."""
        super().reset(seed=seed)
        pose = (options or {}).get('pose', 'random')
        self.state = self.model.start(pose, self.np_random)
        return self._begin(self._sensed(self.state)), {}

    def step(self, action: np.ndarray) -> Step:
        """Hold `action` [V or N m] for one control period."""
        inputs = np.clip(np.asarray(action, float), -self.robot.limits, self.robot.limits)
        before = self.state
        after = self.model.step(before, inputs, self.robot.control_period)
        if self.difference is not None:
            q, dq = self.difference.correct(before.q, before.dq, inputs, after.q, after.dq)
            after = replace(after, q=q, dq=dq)
        self.state = after
        return self._outcome(self._sensed(before), inputs, self._sensed(after))

    def _sensed(self, state: State) -> State:
        q, dq = self.model.sense(state)
        return replace(state, q=q, dq=dq)


def model_env(model: Model) -> ModelEnv:
    """The environment of a model with the difference model its file names, if any.

    Raises:
        UserError: that difference model is not there, or is none of this robot.
    """
    path = model.difference_model
    if path is None:
        return ModelEnv(model)
    if not path.is_file():
        raise UserError(f'no difference model {path}; model.yaml names it')
    difference = from_bytes(path.read_bytes(), str(path))
    if difference.robot != model.robot.name:
        raise UserError(f'{path} is of robot {difference.robot!r}, not {model.robot.name!r}')
    return ModelEnv(model, difference)


def training_env(model: Model) -> ModelEnv:
    """As `model_env`, integrated as robot.yaml says for training: faster, less exact."""
    return model_env(model.changed(scheme='training'))
