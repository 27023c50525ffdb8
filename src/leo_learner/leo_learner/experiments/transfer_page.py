# SPDX-License-Identifier: Apache-2.0
"""Transfers to the real LEO as a table and as the figure of their rounds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
import numpy as np

from leo_learner.experiments.cases import found, Row
from leo_learner.experiments.figures import DPI, HEIGHT, WIDTH
from leo_learner.experiments.markdown import markdown
from leo_learner.experiments.summary import mean_and_half
from leo_learner.experiments.transfer import Case

HEADS = (
    'gap', 'repair', 'seeds', 'distance on the real robot [m]: ideal policy', 'after update 1',
    'of the last driver', 'falls: ideal', 'last', 'J/m: ideal', 'last', 'robot time [s]',
    'one-step MSE', '0.3 s MSE',
)


def table(cases: Sequence[Case], rows: Sequence[Row]) -> str:
    """One line per gap and repair; mean and 95 % interval over the seeds."""
    return markdown(HEADS, [_cells(lines) for lines in grouped(cases, rows).values()])


def figure(title: str, cases: Sequence[Case], rows: Sequence[Row], path: Path) -> None:
    """Distance on the real robot by round: every seed, and the mean."""
    drawing = Figure(figsize=(WIDTH, HEIGHT), layout='constrained')
    axes = drawing.add_subplot()
    for name, lines in grouped(cases, rows).items():
        rounds = range(min(len(line['rounds']) for line in lines))
        each = np.array([[line['rounds'][k][0]['distance'] for k in rounds] for line in lines])
        [mean] = axes.plot(rounds, each.mean(axis=0), marker='o',
                           label=f'{" ".join(name)} (n = {len(lines)})')
        axes.plot(rounds, each.T, color=mean.get_color(), lw=0.6, alpha=0.5)
    axes.set(xlabel='update of the difference model', ylabel='distance in 20 s [m]', title=title)
    axes.set_xticks(range(1 + max(case.updates for case in cases)))
    axes.legend(frameon=False)
    axes.spines[['top', 'right']].set_visible(False)
    drawing.savefig(path, dpi=DPI)


def grouped(cases: Sequence[Case], rows: Sequence[Row]) -> dict[tuple[str, str], list[Row]]:
    """The lines of the cases, those that differ by seed alone together."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for case in cases:
        row = found(case, rows)
        if row is not None:
            groups.setdefault((case.gap, case.repair), []).append(row)
    return groups


def _cells(lines: Sequence[Row]) -> list[str]:
    first = [line['rounds'][0] for line in lines]
    driver = [line['rounds'][line['driver']] for line in lines]
    second = [line['rounds'][min(1, len(line['rounds']) - 1)] for line in lines]
    return [
        lines[0]['gap'], lines[0]['repair'], ' '.join(str(line['seed']) for line in lines),
        *(_interval(_nominal(walks, 'distance')) for walks in (first, second, driver)),
        *(f'{sum(_nominal(walks, "fell"))} of {len(lines)}' for walks in (first, driver)),
        *(_cost(walks) for walks in (first, driver)),
        f'{np.mean([line["samples"] for line in lines]) * 0.03:.0f}',
        *(_error(lines, steps) for steps in (1, 10)),
    ]


def _nominal(walks: Iterable[Sequence[Row]], key: str) -> list[Any]:
    return [each[0][key] for each in walks]


def _interval(values: Sequence[float]) -> str:
    mean, half = mean_and_half(np.array(values))
    return f'{mean:.2f}' if np.isnan(half) else f'{mean:.2f} ± {half:.2f}'


def _cost(walks: Iterable[Sequence[Row]]) -> str:
    known = [cost for cost in _nominal(walks, 'energy_per_metre') if cost is not None]
    return f'{np.mean(known):.1f}' if known else ''


def _error(lines: Sequence[Row], steps: int) -> str:
    before, after = (
        np.mean([line['errors'][f'mse_{name}_{steps}'] for line in lines])
        for name in ('before', 'after')
    )
    return f'{before:.3g} -> {after:.3g}'
