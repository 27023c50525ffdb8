# SPDX-License-Identifier: Apache-2.0
"""How far, in how many footsteps and at what cost an episode walked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from leo_learner.env import RobotSpaces, Step
from leo_sim.description.robot import Robot
from leo_sim.kinematics.gait import Gait
from leo_sim.model import State
from leo_sim.task.task import Task

PAST = 0.02
"""An ankle is past the other once it is this far before it [m]."""


@dataclass(frozen=True)
class Walk:
    """Figures of one episode.

    Attributes:
        distance: m; sum of the footsteps' lengths where the task pays the ankles
            (`ankle_forward`, leo_ode), else travel of the centre of mass (leo).
        footsteps: changes of the stance leg.
        passes: times one ankle passes the other; a limp whose rear leg stays behind has footsteps
            but no passes.
        fell: whether the episode ended before its time.
        energy: electrical work of the motors without credit for what they give back, J; the
            thesis' reward takes a control step of 0.03 s as 1/30 s and so counts a ninth more.
        energy_per_metre: J/m; None where it did not get forward.
        seconds: length of the episode, s.
    """

    distance: float
    footsteps: int
    passes: int
    fell: bool
    energy: float
    energy_per_metre: float | None
    seconds: float


def walks(robot: Robot) -> bool:
    """Whether a robot has the two feet and the motors that these figures need."""
    return len(robot.feet) == 2 and robot.input == 'voltage'


def walked(robot: Robot, q: np.ndarray, dq: np.ndarray, inputs: np.ndarray) -> Walk:
    """The figures of an episode of a robot with two feet.

    Args:
        robot: of the episode.
        q: measured angles at the start and after each control period [rad], (T + 1, J).
        dq: their rates [rad/s], (T + 1, J).
        inputs: voltages held in each period [V], (T, A).
    """
    gait, task = Gait(robot), Task(robot)
    steps = footsteps(gait, q)
    by_feet = any(term.quantity == 'ankle_forward' for term in robot.reward)
    distance = float(sum(steps) if by_feet else gait.com_x(q[-1]) - gait.com_x(q[0]))
    power = task.motor_power(dq[:-1], inputs, dq[1:])
    energy = float(np.sum(power)) * robot.control_period
    fell = bool(task.terminated(State(q[-1], dq[-1])))
    per_metre = energy / distance if distance > 0 else None
    seconds = len(inputs) * robot.control_period
    return Walk(distance, len(steps), passes(gait, q), fell, energy, per_metre, seconds)


def footsteps(gait: Gait, q: np.ndarray) -> list[float]:
    """Length of each footstep [m]: the new stance ankle before the old one; q is (T, J)."""
    stance, lengths = int(gait.stance(q[0], 0)), []
    for row in q[1:]:
        now = int(gait.stance(row, stance))
        if now != stance:
            lengths.append(float(gait.stride(row, stance)))
        stance = now
    return lengths


def passes(gait: Gait, q: np.ndarray) -> int:
    """How often one ankle passes the other; q is (T, J)."""
    apart = gait.stride(q, 0)
    side = np.sign(apart[np.abs(apart) > PAST])
    return int(np.sum(side[1:] != side[:-1]))


class Recorded(gymnasium.Wrapper[np.ndarray, np.ndarray, np.ndarray, np.ndarray]):
    """An environment that remembers the present episode for its `walk`."""

    def __init__(self, env: gymnasium.Env[np.ndarray, np.ndarray]) -> None:
        super().__init__(env)
        assert isinstance(env.unwrapped, RobotSpaces)
        self._base = env.unwrapped
        self._states: list[State] = []
        self._inputs: list[np.ndarray] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode, forget the one before."""
        answer = self.env.reset(seed=seed, options=options)
        self._states, self._inputs = [self._base.sensed], []
        return answer

    def step(self, action: np.ndarray) -> Step:
        """One step of the environment."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        if 'lost' not in info:
            self._states.append(self._base.sensed)
            self._inputs.append(self._base.applied)
        return observation, float(reward), terminated, truncated, info

    def walk(self) -> Walk:
        """Figures of the episode so far."""
        q, dq = np.array([(state.q, state.dq) for state in self._states]).swapaxes(0, 1)
        return walked(self._base.robot, q, dq, np.array(self._inputs))

    def com_path(self) -> np.ndarray:
        """X and z of the centre of mass at the start and after each step so far, m, (T + 1, 2)."""
        return np.asarray(Gait(self._base.robot).com(np.array([s.q for s in self._states])))
