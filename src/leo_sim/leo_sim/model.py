# SPDX-License-Identifier: Apache-2.0
"""A robot with effects and constants, stepped as a pure function of its state."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.effects.base import Placed
from leo_sim.engines.rigid import Rigid
from leo_sim.laws import Laws
from leo_sim.names import nearest
from leo_sim.robot import load_robot, Robot
from leo_sim.substep import integrate, substeps

ENGINES = ('pybullet', 'rigid', 'rk4')


@dataclass(frozen=True)
class State:
    """The state of a model.

    Attributes:
        q: True joint angles rad (m for slides), (J,), never wrapped.
        dq: True joint rates rad/s, (J,).
        memory: What effects remember: past commands, lag, play. Empty = at rest, 0 V before.
    """

    q: np.ndarray
    dq: np.ndarray
    memory: Mapping[str, np.ndarray] = field(default_factory=dict)


class Model:
    """A robot, the effects that act on it, and an engine.

    Args:
        robot: A robot, its name or its folder.
        effects: Effects placed on it.
        constants: Other values for constants of the robot, by path; arrays (S, 1, 1) scan S
            values in `leo_sim.batch.rollout`.
        engine: 'pybullet', 'rigid' (the same numbers without PyBullet), or 'rk4'.
        integration_step: Longest substep s; the robot's when None.
        history: What was added and why, as model.yaml keeps it.
        difference_model: File of a learned difference model that goes with this model.

    Raises:
        UserError: Unknown engine or constant.
    """

    def __init__(self, robot: Robot | str, effects: Sequence[Placed] = (),
                 constants: Mapping[str, Any] | None = None, engine: str = 'pybullet',
                 integration_step: float | None = None,
                 history: Sequence[Mapping[str, Any]] = (),
                 difference_model: Path | None = None):
        self.robot = load_robot(robot) if isinstance(robot, str) else robot
        self.effects = tuple(effects)
        self.constants = _all_constants(self.robot, constants or {})
        if engine not in ENGINES:
            raise UserError(f'no engine {engine!r}{nearest(engine, ENGINES)}')
        self.engine = engine
        self.integration_step = integration_step or self.robot.integration_step
        self.history, self.difference_model = tuple(history), difference_model
        self.laws = Laws(self.robot, self.effects, self.constants)

    def changed(self, **changes: Any) -> Model:
        """A model with another robot, effects, constants, engine or integration_step."""
        kept = {'robot': self.robot, 'effects': self.effects, 'constants': self.constants,
                'engine': self.engine, 'integration_step': self.integration_step,
                'history': self.history, 'difference_model': self.difference_model}
        return Model(**{**kept, **changes})

    def start(self, pose: str = 'nominal', rng: np.random.Generator | None = None) -> State:
        """The state at the start of an episode.

        Args:
            pose: A start pose of the robot; poses with ranges draw from `rng`.
            rng: Random numbers; needed for poses with ranges.

        Raises:
            UserError: Unknown pose.
        """
        poses = self.robot.start_poses
        if pose not in poses:
            raise UserError(f'{self.robot.name} has no start pose {pose!r}{nearest(pose, poses)}')
        rng = rng or np.random.default_rng()
        q, dq = (np.array([_drawn(values.get(j, 0.0), rng) for j in self.robot.joint_names])
                 for values in (poses[pose].angles, poses[pose].rates))
        return State(q, dq)

    def state_from(self, q: Any, dq: Any) -> State:
        """The state at rest whose measured angles and rates are q and dq, (J,)."""
        return State(*self.laws.true_state(np.asarray(q, dtype=float),
                                           np.asarray(dq, dtype=float)))

    def step(self, state: State, inputs: Any, dt: float, enabled: Any = None) -> State:
        """The state after dt s with the inputs held; a pure function, to the bit.

        Args:
            state: Before.
            inputs: V or N m per actuator, (A,), acting after the driver's clip.
            dt: s, > 0.
            enabled: Booleans (A,); None = all motors on.
        """
        count = substeps(dt, self.integration_step)
        u = np.asarray(inputs, dtype=float)
        on = None if enabled is None or np.all(enabled) else np.asarray(enabled, dtype=bool)
        q, dq, memory = self._integrate(self.laws, self._dynamics, state.q, state.dq,
                                        state.memory, u, on, dt / count, count)
        return State(q, dq, memory)

    def sense(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Measured angles and rates (J,), without noise."""
        q, dq, _ = self.laws.sense(state.q, state.dq, state.memory, 0.0)
        return q, dq

    @cached_property
    def rigid(self) -> Rigid:
        """The tree's dynamics on arrays."""
        return Rigid(self.robot.joints, self.laws.bodies, self.laws.gravity)

    @cached_property
    def _dynamics(self) -> Any:
        if self.engine != 'pybullet':
            return self.rigid
        from leo_sim.engines.pybullet import Bullet
        return Bullet(self.robot.urdf, self.robot.joints, self.laws.bodies, self.laws.gravity)

    @cached_property
    def _integrate(self) -> Any:
        if self.engine == 'rk4':
            from leo_sim.engines import rk4
            return rk4.integrate
        return integrate

    def __getstate__(self) -> dict[str, Any]:
        """Without the PyBullet client, which the next process starts itself."""
        return {k: v for k, v in self.__dict__.items() if k not in ('_dynamics', '_integrate')}


def _all_constants(robot: Robot, changed: Mapping[str, Any]) -> dict[str, Any]:
    for path in changed:
        if path not in robot.constants:
            raise UserError(f'{robot.name} has no constant {path!r}'
                            f'{nearest(path, robot.constants)}')
    return {path: c.value for path, c in robot.constants.items()} | dict(changed)


def _drawn(value: Any, rng: np.random.Generator) -> float:
    return float(rng.uniform(*value)) if isinstance(value, tuple) else float(value)
