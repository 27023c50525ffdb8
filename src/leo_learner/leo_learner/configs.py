# SPDX-License-Identifier: Apache-2.0
"""Which configuration of DDPG a robot is trained with: the thesis', or the recommended one."""

from __future__ import annotations

from dataclasses import replace

from leo_learner.ddpg import Config, THESIS
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot

NAMES = ('recommended', 'thesis')
SARSA_STEPS = 1_000_000
RECOMMENDED = replace(
    THESIS,
    hidden=(64, 64),
    actor_rate=1e-3,
    critic_l2=0.0,
    gamma=0.97,
    tau=0.01,
    episode_steps=100,
    noise_sigma=0.5,
    test_interval=12,
    test_starts=3,
    scale=True,
    layer_norm=True,
)
"""The pendulum; it solves it in a fifth of the steps (docs/deviations.md)."""
THESIS_WALKING = replace(THESIS, critic_l2=0.001, warm_up=20_000, replay=300_000)
"""LEO (docs/reference/leo.md 10)."""
RECOMMENDED_WALKING = replace(
    THESIS_WALKING,
    hidden=(128, 128),
    actor_rate=3e-4,
    critic_l2=0.0,
    tau=0.005,
    warm_up=5000,
    episode_steps=150,
    test_steps=3000,
    scale=True,
    twin_critics=True,
)
"""LEO; `leo reproduce ablation` takes back one option after the other."""


def configuration(name: str, robot: Robot) -> Config:
    """The configuration `thesis` or `recommended` for a robot; walkers have feet.

    Raises:
        UserError: no such configuration.
    """
    if name not in NAMES:
        raise UserError(f'no configuration {name!r}; give {" or ".join(NAMES)}')
    if robot.feet:
        return {'thesis': THESIS_WALKING, 'recommended': RECOMMENDED_WALKING}[name]
    return {'thesis': THESIS, 'recommended': RECOMMENDED}[name]


def default_steps(name: str, robot: Robot) -> int:
    """Transitions that a training takes where nothing else is said."""
    if robot.feet:
        return 300_000
    return {'recommended': 10_000, 'thesis': 50_000}[name]
