# SPDX-License-Identifier: Apache-2.0
"""The model of a robot as a gymnasium environment, corrected by a difference model if given."""

from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np

from leo_diffmodel.difference.model import DifferenceModel, load_difference
from leo_sim.description.robot import Robot
from leo_sim.model import Model, State
from leo_sim.model.physics import of_model, of_robot, Physics
from leo_sim.task.task import observation, Task

Step = tuple[np.ndarray, float, bool, bool, dict[str, Any]]


class RobotSpaces(gymnasium.Env[np.ndarray, np.ndarray]):
    """What every environment of a robot shares: spaces, length of an episode, reward.

    Observations are those of robot.yaml; actions are inputs [V, N m or rad] in actuator order.
    """

    sensed: State  # the latest one as the sensors read it; set by `reset` and `step`
    applied: np.ndarray  # inputs of the latest step after the limits [V, N m or rad], (A,)

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.episode_steps = round(robot.episode_seconds / robot.control_period)
        size = len(robot.observation) or 2 * len(robot.joint_names)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float64)
        self.action_space = gymnasium.spaces.Box(-robot.limits, robot.limits, dtype=np.float64)
        self._task = Task(robot)

    @property
    def made_of(self) -> Physics:
        """What a run that is gone on with must find again."""
        return of_robot(self.robot)

    def _begin(self, start: State) -> np.ndarray:
        self._steps, self._stance, self.sensed = 0, 0, start
        return observation(self.robot, start.q, start.dq)

    def _outcome(
        self, before: State, inputs: np.ndarray, after: State, info: dict[str, Any] | None = None
    ) -> Step:
        self._steps += 1
        self.sensed, self.applied = after, inputs
        ended = self._task.terminated(after)
        reward, self._stance = self._task.reward(self._stance, before, inputs, after, ended)
        over = self._steps >= self.episode_steps
        seen = observation(self.robot, after.q, after.dq)
        return seen, float(reward), bool(ended), over, info or {}


class ModelEnv(RobotSpaces):
    """Episodes on `Model.step`, corrected; the corrected state is where the next step starts.

    Observation, reward and termination come from the corrected state as the sensors read it. With
    a difference model `info` has the `factor` of the correction and the `channel` that is furthest
    from its data, as `Judged` has them.
    """

    def __init__(self, model: Model, difference: DifferenceModel | None = None) -> None:
        super().__init__(model.robot)
        self.model, self.difference = model, difference
        self.state = model.start()

    @property
    def made_of(self) -> Physics:
        added = self.difference.digest if self.difference else 'none'
        return of_model(self.model) | {'difference model (hash)': added}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode; `options={'pose': ...}` names a start pose, `random` without it."""
        super().reset(seed=seed)
        self.state = self.model.start((options or {}).get('pose', 'random'), self.np_random)
        return self._begin(self._sensed(self.state)), {}

    def step(self, action: np.ndarray) -> Step:
        """Hold `action` [V, N m or rad] for one control period."""
        inputs = np.clip(np.asarray(action, float), -self.robot.limits, self.robot.limits)
        sensed = self._sensed(self.state)
        info = self.advance(inputs)
        return self._outcome(sensed, inputs, self._sensed(self.state), info)

    def advance(self, inputs: np.ndarray) -> dict[str, Any]:
        """Move `state` on by one control period; what the difference model says of it."""
        if self.difference is None:
            self.state = self.model.step(self.state, inputs, self.robot.control_period)
            return {}
        sensed = self._sensed(self.state)
        judged = self.difference.judge(sensed.q, sensed.dq, inputs)
        self.state = self.difference.applied(self.model, self.state, inputs, judged.correction)
        return {'factor': judged.factor, 'channel': judged.channel}

    def _sensed(self, state: State) -> State:
        q, dq = self.model.sense(state)
        return replace(state, q=q, dq=dq)


def model_env(model: Model) -> ModelEnv:
    if model.difference_model is None:
        return ModelEnv(model)
    return ModelEnv(model, load_difference(model.difference_model, model))


def training_model(model: Model) -> Model:
    """A model integrated as robot.yaml says for training: faster, less exact.

    On the ground it does without PyBullet, whose inertia and bias are the same, but ten calls
    in every control step.
    """
    without = model.engine == 'pybullet' and bool(model.robot.contacts)
    return model.changed(scheme='training', engine='rigid' if without else model.engine)


def training_env(model: Model) -> ModelEnv:
    return model_env(training_model(model))
