# SPDX-License-Identifier: Apache-2.0
"""The simulated robot: the model plus whatever is hidden in it, behind the driver contract."""

import numpy as np

from leo_msgs_py.values import Applied, JointStates
from leo_sim.drivers.base import DriverOptions, robot_info
from leo_sim.model.state import State
from leo_sim.truth.hidden import hidden_model


class SimulatedDriver:
    """A robot in a physics engine; its time starts at 0 and moves only in `advance`.

    Hidden effects act after `write`: what it returns is what a real driver would have sent.
    Noise is added to what is read, once per state, and never enters the simulation.
    """

    def __init__(self, options: DriverOptions) -> None:
        robot = options.robot
        self.info = robot_info(robot, options.state_rate)
        self.starts = 0
        self._noise = np.array(options.noise)
        start_seed, noise_seed = np.random.SeedSequence(options.seed).spawn(2)
        self._start_rng = np.random.default_rng(start_seed)
        self._noise_rng = np.random.default_rng(noise_seed)
        step = options.integration_step or None
        self._model = hidden_model(robot, options.private or {}, options.engine, step)
        self._input = np.zeros(len(robot.actuators))
        self._enabled = np.ones(len(robot.actuators), dtype=bool)
        self._asked = np.isfinite(self.info.rest)
        self._state: State
        self._ticks: int
        self._begin(options.start, 0)

    def connect(self) -> None:
        """Compile what a step needs, which takes seconds the first time on a machine."""
        self._model.step(self._state, self._input, 1.0 / self.info.state_rate, enabled=self._on)

    def read(self) -> JointStates:
        """The state at this time with measurement noise; the same time reads the same."""
        return self._measured

    def write(self, values: np.ndarray) -> Applied:
        """Hold values [V, N m or rad], shape (A,), from now on; a free motor gets 0."""
        limited = np.clip(values, *self.info.bounds)
        self._asked = np.isfinite(limited)
        self._input = np.where(self._on, limited, 0.0)
        names, interface = self.info.actuators, self.info.interface
        return Applied(self._stamp_ns(), names, self._input.copy(), interface, self._on)

    def advance(self, seconds: float) -> float:
        self._state = self._model.step(self._state, self._input, seconds, enabled=self._on)
        self._ticks += 1
        self._measured = self._measure()
        return seconds

    def set_torque(self, on: bool) -> None:
        self._enabled[:] = on

    def reset(self) -> None:
        period = max(1, round(self.info.control_period * self.info.state_rate))
        self._begin(self._start_pose, self._ticks + period)
        self.starts += 1

    def start_in(self, pose: str) -> None:
        self._begin(pose, 0)
        self.starts += 1

    def stop(self) -> None:
        self._input = np.zeros_like(self._input)
        self._asked = np.isfinite(self.info.rest)

    @property
    def _on(self) -> np.ndarray:
        return self._enabled & self._asked

    def _begin(self, pose: str, ticks: int) -> None:
        self._state = self._model.start(pose, self._start_rng, ticks / self.info.state_rate)
        self._start_pose, self._ticks = pose, ticks
        self._measured = self._measure()

    def _measure(self) -> JointStates:
        q, dq = self._model.sense(self._state)
        noise = self._noise_rng.standard_normal((2, len(self.info.joints)))
        position, velocity = np.stack([q, dq]) + self._noise[:, None] * noise
        return JointStates(self._stamp_ns(), self.info.joints, position, velocity)

    def _stamp_ns(self) -> int:
        return round(self._ticks * 1_000_000_000 / self.info.state_rate)
