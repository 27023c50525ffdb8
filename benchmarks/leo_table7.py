# SPDX-License-Identifier: Apache-2.0
"""Thesis Table 7 on LEO: what named effects take off the model's error, what a network takes off.

    python benchmarks/leo_table7.py --seed 1

The real robot has the thesis' gap (torso 1.25 kg, 0.03 N m s/rad in every joint), then a cable at
the left knee besides, which no effect of the catalogue is. The shipped policy walks it with noise
for 5000 transitions; from these effects are named and difference models fitted, to the model as
given and to the named one, in the s' and in the missing-torque form. Errors are mean squares over
the 18 states, one control step and 0.3 s ahead, on a new bag of that policy and on one of its
mirror image, left for right, which no fit saw; beside the mean the median over the windows, as a
foot that lands a moment earlier can make most of a mean.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.difference.data import transitions
from leo_diffmodel.difference.fit import fit
from leo_diffmodel.difference.model import DifferenceModel
from leo_diffmodel.difference.network import CONFIGS
from leo_diffmodel.explain.explanation import explain
from leo_lab.blind import kinds
from leo_lab.thesis.ahead import squares_ahead
from leo_lab.thesis.transfer import real_model, THESIS_GAP
from leo_learner.environment.env import ModelEnv
from leo_learner.environment.rollouts import Rollouts
from leo_learner.learning.collect import collect
from leo_learner.learning.policy import Policy
from leo_learner.training.loop import Act
from leo_sim.effects import get_effect, place
from leo_sim.model import Model

TRANSITIONS, NEW, AHEAD = 5000, 1250, (1, 10)
CABLE = {'k': 1.5, 'slack': -0.6, 'side': 1.0}
"""N m/rad beyond an angle in rad, where the left knee of the shipped policy is at times."""
FORMS = {'recommended': "s' form", 'torque': 'torque form'}


def with_cable(model: Model) -> Model:
    """The robot with a cable at the left knee."""
    cable = get_effect(str(Path(kinds.__file__).with_name('cable.py')))
    return model.changed(effects=[*model.effects, place(model.robot, cable, 'left_knee', **CABLE)])


def mirrored(policy: Policy) -> Act:
    """The policy with left for right in what it sees and drives."""
    seen = _swapped(policy.observation)
    driven = _swapped([a.joint for a in Model(policy.robot).robot.actuators])
    return lambda observation: policy(observation[..., seen])[..., driven]


def _swapped(names: list[str] | tuple[str, ...]) -> list[int]:
    other = {'left': 'right', 'right': 'left'}
    return [
        list(names).index(next((n.replace(a, b) for a, b in other.items() if a in n), n))
        for n in names
    ]


def walked(real: Model, act: Act, steps: int, seed: int) -> Recording:
    """What the real robot did under a policy with noise."""
    robot = Rollouts(ModelEnv(real))
    collect(robot, act, steps, seed)
    return robot.recording()


def corrected(
    bag: Recording, named: Model, seed: int
) -> dict[str, tuple[Model, DifferenceModel | None]]:
    """Every way to take the error off, by its name; the first is none."""
    given = Model(named.robot.name)
    ways: dict[str, tuple[Model, DifferenceModel | None]] = {
        'model as given': (given, None),
        'named effects': (named, None),
    }
    for config, form in FORMS.items():
        for name, model in (('network', given), ('named effects, then network', named)):
            difference, _ = fit(transitions([bag], model), model, CONFIGS[config], seed=seed)
            ways[f'{name}, {form}'] = model, difference
    return ways


def show(title: str, rows: dict[str, list[np.ndarray]], columns: list[str]) -> None:
    """Mean errors, what part of the first row's is gone, and medians."""
    table = Table('', *columns, title=title)
    first = next(iter(rows.values()))
    for name, errors in rows.items():
        table.add_row(
            name,
            *(
                f'{e.mean():.3g} ({100 * (e.mean() / before.mean() - 1):+.2f} %), '
                f'{np.median(e):.2g}'
                for e, before in zip(errors, first, strict=True)
            ),
        )
    Console(width=150).print(table)


def main() -> None:
    """Make both robots, explain, fit and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--seed', type=int, default=1)
    seed = parser.parse_args().seed
    policy, thesis = Policy.load('leo_walk'), real_model(THESIS_GAP)
    for title, real in (('thesis', thesis), ('thesis and a cable', with_cable(thesis))):
        bag = walked(real, policy, TRANSITIONS, seed)
        new = {
            'same policy': walked(real, policy, NEW, seed + 1),
            'its mirror image': walked(real, mirrored(policy), NEW, seed + 2),
        }
        answer = explain([bag], Model('leo'))
        print(
            f'{title}, seed {seed}: {answer.verdict}: '
            f'{[(e["name"], e["where"], e["parameters"]) for e in answer.effects]}; '
            f'{TRANSITIONS} transitions in {len(bag.episodes)} episodes',
            flush=True,
        )
        rows = {
            name: [
                squares_ahead(ModelEnv(model, difference), b, k)
                for b in new.values()
                for k in AHEAD
            ]
            for name, (model, difference) in corrected(bag, answer.model, seed).items()
        }
        step = real.robot.control_period
        show(title, rows, [f'{n}, {step * k:.2g} s' for n in new for k in AHEAD])


if __name__ == '__main__':
    main()
