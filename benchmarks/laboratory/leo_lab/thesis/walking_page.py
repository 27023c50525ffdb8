# SPDX-License-Identifier: Apache-2.0
"""Training runs of LEO as a table and as learning curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from leo_lab.markdown import markdown
from leo_lab.result_lines import Row
from leo_lab.thesis.cases import grouped
from leo_lab.thesis.png_figures import learning_curves
from leo_lab.thesis.summary import FAR, Summary, summary
from leo_lab.thesis.walking import Case

Group = tuple[str, str, str, str, str]
"""Robot, truth, agent, actions, config."""
HEADS = (
    'trained on',
    'agent',
    'seeds',
    'test return: best',
    'median',
    'mean',
    'distance [m]: best',
    'mean',
    f'walk {FAR:g} m',
    'footsteps',
    'passes',
    'J/m',
    'random starts: upright',
    'm',
    'thesis',
)
THESIS: Mapping[Group, tuple[float, float]] = {
    ('leo_ode', 'ideal', 'ddpg', 'sym', 'recommended'): (4573.0, 11.0),
    ('leo_ode', 'ideal', 'ddpg', 'full', 'recommended'): (2462.0, 7.92),
    ('leo_ode', 'ideal', 'sarsa', 'sym', 'thesis'): (2791.0, 7.80),
}
"""Return and distance [m] that thesis Table 3 has for a group."""


def figure(title: str, cases: Sequence[Case], rows: Sequence[Row], path: Path) -> None:
    """Learning curves of the groups."""
    groups = grouped(cases, rows, group)
    learning_curves({' '.join(_named(key)): lines for key, lines in groups.items()}, title, path)


def table(cases: Sequence[Case], rows: Sequence[Row]) -> str:
    """One line per group of cases that differ by seed alone."""
    groups = grouped(cases, rows, group)
    return markdown(HEADS, [cells(key, summary(lines), lines) for key, lines in groups.items()])


def group(case: Case) -> Group:
    """What a case shares with those that differ by seed alone."""
    return case.robot, case.truth, case.agent, case.actions, case.config


def cells(key: Group, told: Summary, rows: Sequence[Row]) -> list[str]:
    """One line of the table."""
    half = '' if np.isnan(told.half) else f' ± {told.half:.0f}'
    beside = '{:.0f}, {:.2f} m'.format(*THESIS[key]) if key in THESIS else ''
    return [
        *_named(key),
        _seeds(rows),
        f'{told.best:.0f}',
        f'{told.median:.0f}',
        f'{told.mean:.0f}{half}',
        f'{told.best_distance:.2f}',
        f'{told.distance:.2f}',
        f'{told.walked} of {told.n}',
        f'{told.footsteps:.0f}',
        f'{told.passes:.0f}',
        '' if np.isnan(told.cost) else f'{told.cost:.1f}',
        f'{100 * told.upright:.0f} %',
        f'{told.random_distance:.2f}',
        beside,
    ]


def _named(key: Group) -> tuple[str, str]:
    robot, truth, agent, actions, config = key
    return f'{robot}, {truth}', f'{agent} {actions} {config}'


def _seeds(rows: Sequence[Row]) -> str:
    return ' '.join(str(row['seed']) for row in rows)
