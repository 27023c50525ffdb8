# SPDX-License-Identifier: Apache-2.0
"""The results page: every experiment that has lines, its table, its figure, its seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from leo_learner.experiments.cases import found, Row
from leo_learner.experiments.catalogue import Experiment, EXPERIMENTS, Group, group
from leo_learner.experiments.figures import learning_curves
from leo_learner.experiments.summary import FAR, Summary, summary

HEADS = (
    'trained on', 'agent', 'seeds', 'test return: best', 'median', 'mean', 'distance [m]: best',
    'mean', f'walk {FAR:g} m', 'footsteps', 'J/m', 'random starts: upright', 'm', 'thesis',
)
ABOUT = """\
# LEO learns to walk: results

Written by `leo reproduce`; one line per training run is in `{results}`. A test is one episode from
the nominal start without noise on the scheme the policy is trained on; the best policy of a run
is the one with the best test. Distances, footsteps and energy are of that policy on the reference
scheme, from the nominal start and from ten random ones (nothing is left out: seeds that do not
walk are in every mean). Return: mean and 95 % interval over the seeds (Student's t).
"""


def write_page(path: Path, results: Path, rows: Sequence[Row]) -> None:
    """The page of all experiments with lines among `rows`, and its figures beside it."""
    parts = [ABOUT.format(results=results)]
    for name, experiment in EXPERIMENTS.items():
        groups = grouped(experiment, rows)
        if groups:
            figure = path.with_name(f'{path.stem}_{name}.png')
            named = {' '.join(_named(key)): lines for key, lines in groups.items()}
            learning_curves(named, experiment.title, figure)
            parts += [f'## {experiment.title}', f'`leo reproduce {name}`', table(experiment, rows)]
            parts.append(f'![{experiment.title}]({figure.name})')
    path.write_text('\n\n'.join(parts) + '\n')


def grouped(experiment: Experiment, rows: Sequence[Row]) -> dict[Group, list[Row]]:
    """The lines of an experiment's cases, those that differ by seed alone together."""
    groups: dict[Group, list[Row]] = {}
    for case in experiment.cases:
        row = found(case, rows)
        if row is not None:
            groups.setdefault(group(case), []).append(row)
    return groups


def table(experiment: Experiment, rows: Sequence[Row]) -> str:
    """The table of an experiment in Markdown."""
    groups = grouped(experiment, rows)
    body = [cells(key, summary(lines), lines, experiment.thesis) for key, lines in groups.items()]
    lines = [HEADS, ['---'] * len(HEADS), *body]
    return '\n'.join(f'| {" | ".join(line)} |' for line in lines)


def cells(
    key: Group, told: Summary, rows: Sequence[Row], thesis: Mapping[Group, tuple[float, float]]
) -> list[str]:
    """One line of the table."""
    half = '' if np.isnan(told.half) else f' ± {told.half:.0f}'
    beside = '{:.0f}, {:.2f} m'.format(*thesis[key]) if key in thesis else ''
    return [
        *_named(key), _seeds(rows), f'{told.best:.0f}', f'{told.median:.0f}',
        f'{told.mean:.0f}{half}', f'{told.best_distance:.2f}', f'{told.distance:.2f}',
        f'{told.walked} of {told.n}', f'{told.footsteps:.0f}',
        '' if np.isnan(told.cost) else f'{told.cost:.1f}', f'{100 * told.upright:.0f} %',
        f'{told.random_distance:.2f}', beside,
    ]


def _named(key: Group) -> tuple[str, str]:
    robot, truth, agent, actions, config = key
    return f'{robot}, {truth}', f'{agent} {actions} {config}'


def _seeds(rows: Sequence[Row]) -> str:
    return ' '.join(str(row['seed']) for row in rows)
