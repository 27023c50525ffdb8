# SPDX-License-Identifier: Apache-2.0
"""Have a walker perform a scripted motion, on a model or as the running robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import gymnasium

from leo_learner.env import RobotSpaces
from leo_sim.task.motions import Routine


@dataclass(frozen=True)
class Performed:
    """What came of it.

    Attributes:
        seconds: how long it moved [s].
        falls: how often it fell and was put up again; each begins an episode.
        complete: False where the robot was restarted meanwhile.
    """

    seconds: float
    falls: int
    complete: bool


def perform(
    env: gymnasium.Env,
    routine: Routine,
    seconds: float,
    seed: int = 0,
    tell: Callable[[], None] = lambda: None,
) -> Performed:
    """Put the robot into the start pose, then drive it, anew after every fall.

    Args:
        env: of the robot, its model or its node, however it is wrapped.
        routine: the motion.
        seconds: to drive, falls included [s].
        seed: of the start poses of a model.
        tell: called after every control period.
    """
    base = env.unwrapped
    assert isinstance(base, RobotSpaces)
    options = {'pose': routine.start}
    env.reset(seed=seed, options=options)
    period, falls = base.robot.control_period, 0
    count = max(1, round(seconds / period))
    for k in range(count):
        volts = routine.volts(base.sensed.q, base.sensed.dq)
        if volts is None:
            env.reset(options=options)
            falls += 1
        elif 'lost' in env.step(volts)[4]:
            return Performed(k * period, falls, False)
        tell()
    return Performed(count * period, falls, True)
