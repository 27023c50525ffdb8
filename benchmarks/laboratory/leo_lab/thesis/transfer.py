# SPDX-License-Identifier: Apache-2.0
"""A policy learned on the ideal LEO moves to the real one: Figure 16 and Table 6 of the thesis.

Algorithm 5 from the ideal policy of a seed, whether or not it falls on the real robot. The real
robot is a model with what the ideal one lacks; everything it does is written to bags, from which
the difference model is fitted (and effects are named) as the difference-model node does.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import date
import json
from pathlib import Path
import time
from typing import Any

from filelock import FileLock
import numpy as np

from leo_lab.thesis import walking
from leo_lab.thesis.ahead import mse_ahead
from leo_lab.thesis.bags import Bags
from leo_learner.algorithm5 import Algorithm5, DONE, Settings
from leo_learner.ddpg.configs import RECOMMENDED_WALKING
from leo_learner.environment.env import model_env, ModelEnv
from leo_learner.environment.rollouts import Left, Recorded, Rollouts
from leo_learner.learning.collect import collect
from leo_learner.learning.policy import Policy
from leo_learner.learning.run import POLICY
from leo_learner.training.loop import play
from leo_sim.model import Model
from leo_sim.truth.drawing import draw

REPAIRS = {
    'network': ('torque', False, True),
    'effects': ('torque', True, False),
    'both': ('torque', True, True),
    'full': ('full', False, True),
}
"""Configuration of the difference model, whether effects are named, whether it is used."""
THESIS_GAP = 'thesis'
FIRST_STEPS = 300_000
PATH_STEPS = 101
"""Of the path of the centre of mass: 3 s."""
TEST_STEPS, TEST_SEED, AHEAD = 1000, 10_000, (1, 10)
"""Of the bag that the errors are taken on, and control steps of 0.03 s ahead."""


@dataclass(frozen=True)
class Case:
    """One transfer.

    Attributes:
        gap: `thesis`, or `hidden-S`: one effect drawn by the seed S.
        repair: one of `REPAIRS`.
        updates: of the difference model, at most.
        transitions: gathered on the real robot before each update.
        steps: retraining after each update.
        seed: of the ideal policy and of everything drawn.
    """

    gap: str
    repair: str
    updates: int
    transitions: int
    steps: int
    seed: int

    @property
    def folder(self) -> Path:
        """Of the transfer, within that of all runs."""
        kind = f'transfer-{self.gap}-{self.repair}-{self.updates}x{self.transitions}-{self.steps}'
        return Path(kind, f'seed-{self.seed}')


def seconds(case: Case) -> float:
    """Usual time of a case on one core, without its `trainings`."""
    return case.updates * (240.0 + 4e-3 * case.steps)


def trainings(case: Case) -> tuple[walking.Case, ...]:
    """The training runs that a case needs, which others may need too."""
    ideal = ideal_case(case.seed)
    return (ideal, ideal_case(case.seed, 'real')) if case.gap == THESIS_GAP else (ideal,)


def share(case: Case, folder: Path) -> float:
    """How much of a case is done, by its updates."""
    path = folder / case.folder / DONE
    return json.loads(path.read_text())['update'] / (1 + case.updates) if path.exists() else 0.0


def real_model(gap: str) -> Model:
    """The real robot of a gap."""
    if gap == THESIS_GAP:
        return walking.model_of(ideal_case(0, truth='real'))
    model = Model('leo')
    effect = draw(model.robot, np.random.default_rng(int(gap.removeprefix('hidden-'))))
    return model.changed(effects=[effect])


def ideal_case(seed: int, truth: str = 'ideal') -> walking.Case:
    """The training run a transfer begins with."""
    return walking.Case('leo', truth, 'ddpg', 'full', 'recommended', FIRST_STEPS, seed)


def run_case(case: Case, folder: Path) -> dict[str, Any]:
    """The line of a case: how the policy of every round walks on the real robot.

    Raises:
        KeyboardInterrupt: it was stopped; it goes on with the phase it was in.
    """
    own, real = folder / case.folder, real_model(case.gap)
    start, reference = _trained(ideal_case(case.seed), folder), _reference(case, folder, real)
    config, names, network = REPAIRS[case.repair]
    robot = Rollouts(ModelEnv(real))
    source = Bags(own, robot, config, names)
    settings = Settings(
        updates=case.updates,
        update_steps=case.steps,
        transitions=case.transitions,
        tests=1,
        network=network,
        seed=case.seed,
    )
    algorithm = Algorithm5(
        own,
        Model('leo'),
        RECOMMENDED_WALKING,
        settings,
        robot,
        source,
        start=start,
        say=lambda text: None,
        quiet=True,
    )
    if algorithm.done.phase == 'update' and not source.bag(algorithm.done.version).exists():
        algorithm.gather_again()
    if not algorithm.run():
        raise KeyboardInterrupt
    began = time.monotonic() - algorithm.done.seconds  # as if it had not been stopped
    policies = [Policy.load(path) for path in algorithm.policies()]
    driver = policies[algorithm.done.driver]
    return asdict(case) | {
        'rounds': [walking.judge(policy, policy.on(model_env(real))) for policy in policies],
        'driver': algorithm.done.driver,
        'samples': algorithm.done.samples,
        'fits': source.reports(),
        'errors': _errors(algorithm, real),
        'paths': [_path(policy, real) for policy in (policies[0], driver)],
        'left': [asdict(_left(policy, algorithm)) for policy in (policies[0], driver)],
        **reference,
        'seconds': round(time.monotonic() - began, 1),
        'date': str(date.today()),
    }


def _trained(case: walking.Case, folder: Path) -> Path:
    """The folder of a training run, which is made or finished where it is not there.

    Cases that run at the same time may need the same one: the first makes it.
    """
    own = folder / case.folder
    own.mkdir(parents=True, exist_ok=True)
    with FileLock(own / '.lock'):
        if walking.share(case, folder) < 1 or not (own / POLICY).exists():
            walking.train(case, folder)
    return own


def _reference(case: Case, folder: Path, real: Model) -> dict[str, Any]:
    """How the policy walks that was trained on the real robot of the thesis, and its curve."""
    if case.gap != THESIS_GAP:
        return {}
    trained = _trained(ideal_case(case.seed, 'real'), folder)
    policy = Policy.load(trained / POLICY)
    return {
        'reference': walking.judge(policy, policy.on(model_env(real))),
        'reference_curve': walking.curve(trained),
    }


def _path(policy: Policy, real: Model) -> list[list[float]]:
    """Centre of mass in the first seconds from the nominal start, x and z [m]."""
    recorded = Recorded(policy.on(ModelEnv(real)))
    play(recorded, policy, 1)
    return np.round(recorded.com_path()[:PATH_STEPS], 4).tolist()


def _left(policy: Policy, algorithm: Algorithm5) -> Left:
    """Where a policy leaves the data of the last difference model, from the nominal start."""
    model, difference = algorithm.corrected()
    if difference is None:
        return Left(None, None, 0.0)
    watched = Recorded(policy.on(ModelEnv(model, difference)), difference)
    play(watched, policy, 1)
    return watched.left()[0]


def _errors(algorithm: Algorithm5, real: Model) -> dict[str, float | None]:
    """One-step and 0.3 s errors on a new bag of the policy that drives the robot in the end."""
    robot = Rollouts(ModelEnv(real))
    collect(robot, Policy.load(algorithm.best), TEST_STEPS, TEST_SEED)
    model, difference = algorithm.corrected()
    given, corrected = ModelEnv(Model('leo')), ModelEnv(model, difference)
    return {
        f'mse_{name}_{steps}': mse_ahead(env, robot.recording(), steps)
        for name, env in (('before', given), ('after', corrected))
        for steps in AHEAD
    }
