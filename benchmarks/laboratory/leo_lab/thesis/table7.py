# SPDX-License-Identifier: Apache-2.0
"""Thesis Table 7 and Figures 13-15: the pendulum whose mass is not the model's.

One case = one seed: learn on the ideal model, gather transitions on the real one, repair (by a
difference model, or by the effects that `leo explain` names), retrain, and compare with a policy
that learned on the real one. One JSON line per case goes to a results file.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import date
import json
from pathlib import Path
import time
from typing import Any

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.difference.data import layout_of, transitions
from leo_diffmodel.difference.fit import fit
from leo_diffmodel.difference.network import CONFIGS as NETWORKS
from leo_lab.thesis.walking import curve
from leo_learner.ddpg.agent import Training
from leo_learner.ddpg.configs import configuration
from leo_learner.environment.env import ModelEnv
from leo_learner.environment.rollouts import Rollouts
from leo_learner.learning.checkpoint import start_from
from leo_learner.learning.collect import collect
from leo_learner.learning.policy import Policy
from leo_learner.learning.run import learn
from leo_learner.training.loop import play
from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.description.robot import Robot
from leo_sim.effects import place
from leo_sim.effects.base import Placed
from leo_sim.model import Model
from leo_sim.model.model_file import load_model, save_model

TRUTHS = {
    'moved': {'link_mass': {'m': 0.035}, 'link_inertia': {'I': -6.17e-5}},
    'mass': {'link_mass': {'m': 0.035}},
}
"""`moved`: 0.09 kg with the inertia about the pivot kept, as in the thesis."""
REPAIRS = ('recommended', 'thesis', 'explain')
"""A difference model of either configuration, or the effects that `leo explain` names."""
NOISE = (1e-3, 0.02)
"""Of the sensors `leo explain` sees through: angle [rad], rate [rad/s], standard deviations."""
STARTS, STARTS_SEED = 20, 10_000


@dataclass(frozen=True)
class Case:
    """One line of the results file.

    Attributes:
        truth: key of `TRUTHS`.
        repair: one of `REPAIRS`.
        transitions: gathered on the real pendulum.
        config: of DDPG.
        steps: training on the ideal and on the real model.
        more_steps: training after the repair, from the best policy of the ideal model.
        seed: of everything drawn.
    """

    truth: str
    repair: str
    transitions: int
    config: str
    steps: int
    more_steps: int
    seed: int


def run_case(case: Case, folder: Path, quiet: bool = False) -> dict[str, Any]:
    """The results of one case; training runs in `folder` are taken up where they were."""
    began = time.monotonic()
    ideal = Model('pendulum')
    real = ideal.changed(effects=effects(ideal.robot, case.truth))
    trained = _Trainer(case, folder, quiet)
    first = trained.on('ideal', ModelEnv(ideal), case.steps)
    reference = trained.on(f'{case.truth}-real', ModelEnv(real), case.steps)
    gathered = Rollouts(ModelEnv(real))
    collect(gathered, first, case.transitions, case.seed)
    name = f'{case.truth}-{case.repair}-{case.transitions}'
    env, told = _repaired(case, ideal, gathered.recording(), trained.folder / f'{name}.yaml')
    last = trained.on(name, env, case.more_steps, start='ideal')
    returns = {
        f'return_{name}': float(play(ModelEnv(real), policy, STARTS, STARTS_SEED).mean())
        for name, policy in (('ideal', first), ('repaired', last), ('real', reference))
    }
    curves = {
        kind: curve(trained.folder / folder_name)
        for kind, folder_name in (
            ('ideal', 'ideal'),
            ('repaired', name),
            ('real', f'{case.truth}-real'),
        )
    }
    seconds = round(time.monotonic() - began, 1)
    return (
        vars(case)
        | told
        | returns
        | {'curves': curves, 'seconds': seconds, 'date': str(date.today())}
    )


def effects(robot: Robot, truth: str) -> tuple[Placed, ...]:
    """The effects of a truth."""
    return tuple(place(robot, name, 'bob', **values) for name, values in TRUTHS[truth].items())


def shares(rows: list[dict[str, Any]]) -> list[float]:
    """Share of the gap closed per seed, against the best policy trained on the real pendulum."""
    best = max(row['return_real'] for row in rows)
    return [
        (row['return_repaired'] - row['return_ideal']) / (best - row['return_ideal'])
        for row in rows
    ]


def share(rows: list[dict[str, Any]]) -> float:
    """Share of the gap closed by the mean returns over the seeds."""
    ideal, repaired = (
        np.mean([row[f'return_{name}'] for row in rows]) for name in ('ideal', 'repaired')
    )
    return float((repaired - ideal) / (max(row['return_real'] for row in rows) - ideal))


class _Trainer:
    """Trains one policy per name in a folder of the case's configuration and seed."""

    def __init__(self, case: Case, folder: Path, quiet: bool) -> None:
        self._case, self._quiet = case, quiet
        self.folder = folder / f'{case.config}-{case.steps}' / f'seed-{case.seed}'

    def on(self, name: str, env: ModelEnv, steps: int, start: str | None = None) -> Policy:
        config = configuration(self._case.config, env.robot)
        training = Training(env, config, self._case.seed)
        if start is not None:
            start_from(self.folder / start, training)
        folder = self.folder / name
        title = f'seed {self._case.seed}, {name}'
        outcome = learn(training, env.robot, steps, folder, title=title, quiet=self._quiet)
        if not outcome.finished:
            raise KeyboardInterrupt
        if outcome.steps >= steps + env.episode_steps:
            raise UserError(f'{folder} holds a longer run ({outcome.steps} steps); remove it')
        return Policy.load(outcome.policy)


def _repaired(
    case: Case, ideal: Model, recording: Recording, explained: Path
) -> tuple[ModelEnv, dict[str, Any]]:
    """The environment to retrain on, and the one-step errors over (cos, sin, rate)."""
    if case.repair == 'explain':
        return _explained(case, ideal, recording, explained)
    steps = transitions([recording], ideal, case.transitions)
    model, report = fit(steps, ideal, NETWORKS[case.repair], seed=case.seed)
    told = {'mse_before': report.mse_before, 'mse_after': report.mse_after}
    return ModelEnv(ideal, model), told


def _explained(
    case: Case, ideal: Model, recording: Recording, path: Path
) -> tuple[ModelEnv, dict[str, Any]]:
    """The model with the effects found; kept in `path`, what was said beside it."""
    from leo_diffmodel.explain.explanation import explain

    if not path.exists():
        result = explain([_measured(recording, case.seed)], ideal)
        said = {'verdict': result.verdict, 'sentence': result.sentence}
        write_whole(path.with_suffix('.json'), json.dumps(said))
        save_model(path, result.model)
    model = load_model(path)
    before, after = (_mse(recording, each, case.transitions) for each in (ideal, model))
    said = json.loads(path.with_suffix('.json').read_text())
    return ModelEnv(model), {'mse_before': before, 'mse_after': after} | said


def _measured(recording: Recording, seed: int) -> Recording:
    """The recording as sensors with `NOISE` would have made it."""
    rng = np.random.default_rng(seed)
    return replace(
        recording,
        episodes=tuple(
            replace(
                episode,
                q=episode.q + NOISE[0] * rng.standard_normal(episode.q.shape),
                dq=episode.dq + NOISE[1] * rng.standard_normal(episode.dq.shape),
            )
            for episode in recording.episodes
        ),
    )


def _mse(recording: Recording, model: Model, limit: int) -> float:
    """One-step error over the state vector on the last quarter, as the difference fits score."""
    layout, steps = layout_of(model.robot), transitions([recording], model, limit)
    held_out = steps.part(slice(round(0.75 * len(steps)), None))
    real = layout.state(held_out.q_next, held_out.dq_next)
    return float(np.mean((real - layout.state(held_out.q_model, held_out.dq_model)) ** 2))
