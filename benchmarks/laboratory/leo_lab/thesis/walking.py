# SPDX-License-Identifier: Apache-2.0
"""LEO learns to walk: one training run and what its best policy does, as one case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any

import gymnasium
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.backend.event_processing.event_file_loader import EventFileLoader

from leo_lab.thesis import sarsa
from leo_learner.ddpg.agent import Training
from leo_learner.ddpg.configs import Config, RECOMMENDED_WALKING, THESIS_WALKING
from leo_learner.environment.env import model_env, training_env
from leo_learner.environment.rollouts import Recorded
from leo_learner.environment.walk import Walk
from leo_learner.learning.checkpoint import PREFIX
from leo_learner.learning.policy import driven, Policy
from leo_learner.learning.run import learn, POLICY
from leo_learner.training.loop import Act, play, TrainingLoop
from leo_sim.description.robot import load_robot, Robot
from leo_sim.description.robot_file import TerminationFile
from leo_sim.effects import place
from leo_sim.model import Model

STARTS = 11
"""Episodes that the best policy is judged by: the nominal start and ten random ones."""
ABLATION = {
    'one_critic': replace(RECOMMENDED_WALKING, twin_critics=False),
    'layer_norm': replace(RECOMMENDED_WALKING, layer_norm=True),
    'whole_episodes': replace(RECOMMENDED_WALKING, episode_steps=None),
    'unscaled': replace(RECOMMENDED_WALKING, scale=False),
    'thesis_rates': replace(RECOMMENDED_WALKING, actor_rate=1e-4, tau=0.001),
}
"""The recommended configuration for LEO with one option changed."""
CONFIGS = {'recommended': RECOMMENDED_WALKING, 'thesis': THESIS_WALKING, **ABLATION}
KNEE_ENDS = '+knee_ends'
"""Follows a configuration's name where a straight knee ends the episode, as in the thesis' code;
without it the knee has the stop of the real robot."""


@dataclass(frozen=True)
class Case:
    """One training run.

    Attributes:
        robot: `leo` or `leo_ode`.
        truth: what it is trained on: `ideal`, or `real`, see `model_of`.
        agent: `ddpg` or `sarsa`.
        actions: `full` or `sym`.
        config: of `CONFIGS`, with or without `KNEE_ENDS`.
        steps: transitions.
        seed: of everything drawn.
    """

    robot: str
    truth: str
    agent: str
    actions: str
    config: str
    steps: int
    seed: int

    @property
    def folder(self) -> Path:
        """Of the run, within that of all runs."""
        kind = f'{self.robot}-{self.truth}-{self.agent}-{self.actions}-{self.config}'
        return Path(f'{kind}-{self.steps}', f'seed-{self.seed}')


def seconds(case: Case) -> float:
    """Usual time of a case on one core."""
    return case.steps * {'ddpg': 4.5e-3, 'sarsa': 1.5e-3}[case.agent]


def model_of(case: Case) -> Model:
    """The model that a case is trained on.

    `real` is the robot of thesis Table 5: a torso of 1.25 kg and viscous friction of
    0.03 N m s/rad in every joint.
    """
    robot = load_robot(case.robot)
    if case.config.endswith(KNEE_ENDS):
        robot = _with_knees_that_end(robot)
    ideal = Model(robot)
    if case.truth == 'ideal':
        return ideal
    friction = place(ideal.robot, 'viscous_friction', 'all', b=0.03)
    return ideal.changed(
        effects=[friction], constants={**ideal.constants, 'links.torso.mass': 1.25}
    )


def train(case: Case, folder: Path, quiet: bool = True) -> TrainingLoop:
    """The training run of a case in `folder`; one that was stopped goes on.

    Raises:
        KeyboardInterrupt: it was stopped.
    """
    model = model_of(case)
    training = _training(case, model)
    outcome = learn(
        training,
        model.robot,
        case.steps,
        folder / case.folder,
        title=f'{case.folder}',
        quiet=quiet,
    )
    if not outcome.finished:
        raise KeyboardInterrupt
    return training


def run_case(case: Case, folder: Path) -> dict[str, Any]:
    """The line of a case: its curve of tests, and how its best policy walks."""
    training = train(case, folder)
    act = _best(training, folder / case.folder / POLICY)
    walks = judge(act, driven(model_env(model_of(case)), case.actions))
    return asdict(case) | {
        'test_return': training.best_return,
        'curve': curve(folder / case.folder),
        'nominal': walks[0],
        'random': walks[1:],
        'seconds': round(spent(folder / case.folder), 3),
        'date': str(date.today()),
    }


def share(case: Case, folder: Path) -> float:
    """How much of a case's training its newest checkpoint has."""
    names = [path.name for path in (folder / case.folder).glob(f'{PREFIX}*')]
    steps = max((int(name.removeprefix(PREFIX)) for name in names), default=0)
    return min(steps / case.steps, 1.0)


def judge(act: Act, env: gymnasium.Env) -> list[dict[str, Any]]:
    """Return and `Walk` of a policy's episodes: nominal start, then random ones."""
    recorded = Recorded(env)
    walks: list[Walk] = []
    returns = play(recorded, act, STARTS, on_episode=lambda: walks.append(recorded.walk()))
    return [{'return': float(r)} | asdict(walk) for r, walk in zip(returns, walks, strict=True)]


def curve(folder: Path) -> list[tuple[int, float]]:
    """Transitions and return of every test of a run."""
    events = EventAccumulator(str(folder), size_guidance={'scalars': 0}).Reload()
    return [(event.step, round(event.value, 2)) for event in events.Scalars('charts/test_return')]


def spent(folder: Path) -> float:
    """Wall time that a run has taken [s], also before it was stopped and gone on with.

    Every part of a run has a file of TensorBoard's events.
    """
    parts = [
        [event.wall_time for event in EventFileLoader(str(path)).Load()]
        for path in folder.glob('events.out.tfevents.*')
    ]
    return sum(max(times) - min(times) for times in parts if times)


def _training(case: Case, model: Model) -> TrainingLoop:
    env = driven(training_env(model), case.actions)
    makers: dict[str, Callable[[], TrainingLoop]] = {
        'sarsa': lambda: sarsa.Training(env, sarsa.Config(), case.seed),
        'ddpg': lambda: Training(env, config_of(case.config), case.seed),
    }
    return makers[case.agent]()


def _best(training: TrainingLoop, policy: Path) -> Act:
    """The best policy by test; `Policy.load` reads those of DDPG alone."""
    return training.best_act() if isinstance(training, sarsa.Training) else Policy.load(policy)


def config_of(name: str) -> Config:
    """The configuration of DDPG behind a case's `config`."""
    return CONFIGS[name.removesuffix(KNEE_ENDS)]


def _with_knees_that_end(robot: Robot) -> Robot:
    ends = tuple(
        TerminationFile(quantity='angle', joint=joint, high=0.0)
        for joint in ('left_knee', 'right_knee')
    )
    return replace(robot, termination=robot.termination + ends)
