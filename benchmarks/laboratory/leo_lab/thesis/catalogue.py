# SPDX-License-Identifier: Apache-2.0
"""The experiments on LEO by name: which cases, how they are run and shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from leo_lab.result_lines import read_results, Row
from leo_lab.thesis import transfer, transfer_page, walking, walking_page
from leo_lab.thesis.cases import missing, pace
from leo_lab.thesis.walking import ABLATION, KNEE_ENDS
from leo_lab.thesis.walking_page import Group


@dataclass(frozen=True)
class Kind:
    """What the cases of an experiment are.

    Attributes:
        file: name of the results file.
        run: makes the line of a case, given the folder of all runs.
        seconds: usual time of a case on one core.
        share: how much of a case is done in the folder of all runs, 0 to 1.
        trainings: the training runs a case needs besides.
        table: Markdown.
        figure: writes a PNG.
    """

    file: str
    run: Callable[..., Row]
    seconds: Callable[[Any], float]
    share: Callable[[Any, Path], float]
    trainings: Callable[[Any], tuple[walking.Case, ...]]
    table: Callable[[Sequence[Any], Sequence[Row]], str]
    figure: Callable[[str, Sequence[Any], Sequence[Row], Path], None]


WALKING = Kind(
    'leo_walking.jsonl',
    walking.run_case,
    walking.seconds,
    walking.share,
    lambda case: (),
    walking_page.table,
    walking_page.figure,
)
TRANSFER = Kind(
    'leo_transfer.jsonl',
    transfer.run_case,
    transfer.seconds,
    transfer.share,
    transfer.trainings,
    transfer_page.table,
    transfer_page.figure,
)


@dataclass(frozen=True)
class Experiment:
    """Cases that are read together, in the order they are run.

    Attributes:
        title: of its part of the results page.
        kind: what the cases are.
        cases: in the order they are run.
        thesis: what the thesis has beside the table, in words.
    """

    title: str
    kind: Kind
    cases: tuple[Any, ...]
    thesis: str = ''

    def first(self, seeds: int | None) -> Experiment:
        """Its cases of the first seeds; None for all."""
        return replace(self, cases=tuple(c for c in self.cases if seeds is None or c.seed < seeds))


def _runs(kind: Group, steps: int, seeds: Sequence[int]) -> tuple[walking.Case, ...]:
    return tuple(walking.Case(*kind, steps=steps, seed=seed) for seed in seeds)


def _transfers(gap: str, repair: str, updates: int, seeds: int) -> tuple[transfer.Case, ...]:
    return tuple(
        transfer.Case(gap, repair, updates, TRANSITIONS, UPDATE_STEPS, seed)
        for seed in range(seeds)
    )


def training_hours(experiment: Experiment, results: Path, folder: Path, jobs: int) -> float:
    """How long the training runs take that the missing cases need and `folder` has not."""
    left = missing(experiment.cases, results / experiment.kind.file)
    runs = {run for case in left for run in experiment.kind.trainings(case)}
    seconds = sum(walking.seconds(run) * (1 - walking.share(run, folder)) for run in runs)
    return seconds * pace(read_results(results / WALKING.file), walking.seconds) / jobs / 3600


TRANSITIONS, UPDATE_STEPS = 5000, 60_000
EXPERIMENTS = {
    'walk': Experiment(
        'LEO learns to walk on the ideal model',
        WALKING,
        _runs(('leo', 'ideal', 'ddpg', 'full', 'recommended'), 300_000, range(10)),
    ),
    'real': Experiment(
        'LEO learns to walk on the real model',
        WALKING,
        _runs(('leo', 'real', 'ddpg', 'full', 'recommended'), 300_000, range(4)),
    ),
    'table6': Experiment(
        'From the ideal to the real LEO: thesis Figure 16 and Table 6',
        TRANSFER,
        _transfers('thesis', 'network', 2, 4) + _transfers('thesis', 'effects', 1, 4),
        'The thesis: 126.4, 110.4 and 90.5 J/m (Table 6); 15 minutes of the real robot, where '
        'training there from scratch takes 150.',
    ),
    'table3': Experiment(
        'Thesis Table 3: DDPG and SARSA on leo_ode',
        WALKING,
        _runs(('leo_ode', 'ideal', 'ddpg', 'sym', 'recommended'), 300_000, range(4))
        + _runs(('leo_ode', 'ideal', 'ddpg', 'full', 'recommended'), 300_000, range(3))
        + _runs(('leo_ode', 'ideal', 'sarsa', 'sym', 'thesis'), 1_000_000, range(2)),
    ),
    'literal': Experiment(
        'DDPG as the thesis has it',
        WALKING,
        _runs(('leo', 'ideal', 'ddpg', 'full', f'thesis{KNEE_ENDS}'), 300_000, range(2))
        + _runs(('leo', 'ideal', 'ddpg', 'full', 'thesis'), 300_000, range(3)),
    ),
    'ablation': Experiment(
        'What each option is worth',
        WALKING,
        tuple(
            case
            for name in ('recommended', *ABLATION)
            for case in _runs(('leo', 'ideal', 'ddpg', 'full', name), 200_000, range(2))
        ),
    ),
    'rows': Experiment(
        'Network, named effects, both, or a full model',
        TRANSFER,
        tuple(
            case
            for gap in ('thesis', 'hidden-1')
            for repair in transfer.REPAIRS
            for case in _transfers(gap, repair, 1, 2)
        ),
    ),
}
