# SPDX-License-Identifier: Apache-2.0
"""Run a policy with noise to gather transitions; perform a scripted motion."""

from collections.abc import Callable
from dataclasses import dataclass

import gymnasium
import numpy as np

from leo_learner.ddpg.agent import OrnsteinUhlenbeck
from leo_learner.environment.env import RobotSpaces
from leo_learner.training.loop import Act, run_episode
from leo_sim.task.motions import Routine

COLLECT_THETA, COLLECT_SIGMA = 0.15, 0.1
"""Noise while gathering transitions on the robot (docs/reference/leo.md 10)."""


def collect(
    env: gymnasium.Env,
    act: Act,
    steps: int,
    seed: int = 0,
    on_step: Callable[[], None] = lambda: None,
) -> None:
    """Drive `steps` transitions from random starts with noise on the policy; others record.

    The last episode ends where they are reached; `on_step` is called after every one.
    """
    assert isinstance(env.action_space, gymnasium.spaces.Box)
    limit, done, episode = env.action_space.high, 0, 0

    def counted() -> bool:
        nonlocal done
        done += 1
        on_step()
        return done < steps

    while done < steps:
        rng = np.random.default_rng([seed, episode])
        noise = OrnsteinUhlenbeck(len(limit), COLLECT_THETA, COLLECT_SIGMA, rng)

        def noisy(seen: np.ndarray, noise: OrnsteinUhlenbeck = noise) -> np.ndarray:
            return np.clip(act(seen) + noise() * limit, -limit, limit)

        run_episode(env, noisy, int(rng.integers(2**31)), 'random', counted)
        episode += 1


@dataclass(frozen=True)
class Performed:
    seconds: float  # how long it moved [s]
    falls: int  # how often it fell and was put up again; each begins an episode
    complete: bool  # False where the robot was restarted meanwhile


def perform(
    env: gymnasium.Env,
    routine: Routine,
    seconds: float,
    seed: int = 0,
    on_step: Callable[[], None] = lambda: None,
) -> Performed:
    """Put the robot into the start pose, then drive it `seconds` [s], anew after every fall.

    `seed` is that of a model's start poses; `on_step` is called after every control period.
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
        on_step()
    return Performed(count * period, falls, True)
