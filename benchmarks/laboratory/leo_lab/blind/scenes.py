# SPDX-License-Identifier: Apache-2.0
"""What happens in a blind case: one scene after another, each a recording of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.effects import Placed
from leo_sim.model import Model, State
from leo_sim.model.batch import rollout
from leo_sim.task.motions import MOTIONS, PUT_UP, Routine

Array = np.ndarray
Effects = tuple[Placed, ...]
Step = Callable[[int, Array, Array], tuple[Array, Array] | None]
"""Inputs and enabled (A,) of a control period from its number and what is measured at its start;
None: the robot is to be put into its start pose again."""
Rows = list[tuple[Array, Array, Array, Array]]
"""Angles, rates, inputs and enabled of each control period."""


class Path(NamedTuple):
    """Where a robot comes by, without noise.

    Attributes:
        q, dq: true angles and rates at the start of each control period, and at the end of the
            last, shape (N+1, J).
        inputs, enabled: held over each, shape (N, A).
        held: the base does not move.
        since: when it begins, after the run did [s].
    """

    q: Array
    dq: Array
    inputs: Array
    enabled: Array
    held: bool = False
    since: float = 0.0


@dataclass(frozen=True)
class Given:
    """Inputs fixed beforehand, on a robot without contact.

    Attributes:
        inputs: of each control period [V, N m or rad], shape (N, A).
        enabled: motors on, shape (N, A).
    """

    inputs: Array
    enabled: Array
    start = 'nominal'
    held = False

    @property
    def count(self) -> int:
        """Control periods."""
        return len(self.inputs)

    def begin(self) -> Step:
        """What drives the robot."""
        return lambda k, q, dq: (self.inputs[k], self.enabled[k])

    def paths(self, robot: Robot, effects: Effects, noise: tuple[float, float]) -> list[Path]:
        """The run of a robot with effects."""
        start = Model(robot).start('nominal')
        q, dq = rollout(
            Model(robot, effects),
            start.q[None],
            start.dq[None],
            self.inputs[None],
            robot.control_period,
            self.enabled[None],
        )
        return [Path(q[0], dq[0], self.inputs, self.enabled)]


@dataclass(frozen=True)
class Moving:
    """A scripted motion of a walker, which answers to what it measures.

    Attributes:
        robot: the robot.
        motion: of `MOTIONS`.
        count: control periods.
        seed: of the motion's figures.
    """

    robot: Robot
    motion: str
    count: int
    seed: int

    @property
    def start(self) -> str:
        """The start pose."""
        return MOTIONS[self.motion].start

    @property
    def held(self) -> bool:
        """Whether the base does not move."""
        return self.robot.start_poses[self.start].held

    def begin(self) -> Step:
        """What drives the robot; after a fall it begins anew, in another way."""
        routine = Routine(self.robot, self.motion, self.seed)
        on = np.ones(len(self.robot.actuators), dtype=bool)

        def step(k: int, q: Array, dq: Array) -> tuple[Array, Array] | None:
            volts = routine.volts(q, dq)
            return None if volts is None else (volts, on)

        return step

    def paths(self, robot: Robot, effects: Effects, noise: tuple[float, float]) -> list[Path]:
        """Each of the ways between two falls of a robot with effects, and measurement noise.

        Raises:
            UserError: the robot runs away.
        """
        ways = self._ways(Model(robot, effects, engine='rigid', scheme='search'), noise)
        return [_path(rows, end, self.held, since) for rows, end, since in ways if rows]

    def _ways(
        self, model: Model, noise: tuple[float, float]
    ) -> Iterator[tuple[Rows, State, float]]:
        """The rows of each way, the state at its end, and when it began [s]."""
        step, rng, since = self.begin(), np.random.default_rng(self.seed), 0.0
        state, rows = model.start(self.start, rng), Rows()
        for k in range(self.count):
            seen = np.stack(model.sense(state))
            seen = seen + np.array(noise)[:, None] * rng.standard_normal(seen.shape)
            driven = step(k, *seen)
            if driven is None:
                yield rows, state, since
                since = (k + PUT_UP) * model.robot.control_period
                state, rows = model.start(self.start, rng, since), Rows()
                continue
            rows.append((state.q, state.dq, *driven))
            state = model.step(state, driven[0], model.robot.control_period)
        yield rows, state, since


def _path(rows: Rows, end: State, held: bool, since: float) -> Path:
    q, dq, inputs, enabled = (np.array(column) for column in zip(*rows, strict=True))
    return Path(np.vstack([q, end.q]), np.vstack([dq, end.dq]), inputs, enabled, held, since)


Scene = Given | Moving
