# SPDX-License-Identifier: Apache-2.0
"""The numbers of DDPG: the thesis', and what each robot is best trained with.

`THESIS` is the reference, number by number from sections 9 and 10 of docs/reference/leo.md; every
option that differs from it is off there. docs/ddpg.md lists every deviation.
"""

from dataclasses import dataclass, replace

from leo_learner.training.loop import LoopConfig
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot

NAMES = ('recommended', 'thesis')


@dataclass(frozen=True)
class Config(LoopConfig):
    """All numbers of a training run; the thesis' by default."""

    hidden: tuple[int, ...] = (400, 300)  # units of the hidden ReLU layers of actor and critic
    actor_rate: float = 1e-4  # Adam's learning rate
    critic_rate: float = 1e-3
    critic_l2: float = 0.01  # on the critic's weights, added to its loss as 1/2 c |W|^2
    gamma: float = 0.99  # discount per control step
    tau: float = 0.001  # share of the learned weights that moves into the targets per update
    batch: int = 64  # transitions per update
    replay: int = 1_000_000  # transitions held
    warm_up: int = 1000  # transitions gathered before the first update
    noise_theta: float = 0.15  # Ornstein-Uhlenbeck pull towards zero per step
    noise_sigma: float = 0.2  # Ornstein-Uhlenbeck step, in the action's [-1, 1]
    scale: bool = False  # divide observations and rewards by their spread over the warm-up
    layer_norm: bool = False  # before each hidden ReLU
    twin_critics: bool = False  # the target takes the lower value (Fujimoto et al. 2018)


THESIS = Config()
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
    if name not in NAMES:
        raise UserError(f'no configuration {name!r}; give {" or ".join(NAMES)}')
    if robot.feet:
        return {'thesis': THESIS_WALKING, 'recommended': RECOMMENDED_WALKING}[name]
    return {'thesis': THESIS, 'recommended': RECOMMENDED}[name]


def default_steps(name: str, robot: Robot) -> int:
    return 300_000 if robot.feet else {'recommended': 10_000, 'thesis': 50_000}[name]
