# SPDX-License-Identifier: Apache-2.0
"""Where a rollout leaves the data of its difference model: why a transferred policy fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import gymnasium
import numpy as np

from leo_diffmodel.difference.layout import channel_names
from leo_diffmodel.difference.model import DifferenceModel
from leo_learner.env import RobotSpaces, Step

OUTSIDE = 0.5
"""A step is outside the data where less than this share of the correction is left."""


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
    """Keeps what a difference model says of every step.

    Args:
        env: a model, or the running robot.
        difference: a difference model that knows where its data end.
    """

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
