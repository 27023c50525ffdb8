# SPDX-License-Identifier: Apache-2.0
"""Transfers to the real LEO as a table and as the figure of their rounds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
import numpy as np

from leo_lab.markdown import markdown
from leo_lab.result_lines import Row
from leo_lab.thesis.cases import grouped
from leo_lab.thesis.png_figures import DPI, HEIGHT, WIDTH
from leo_lab.thesis.summary import mean_and_half
from leo_lab.thesis.transfer import Case

HEADS = (
    'gap',
    'repair',
    'seeds',
    'distance on the real robot [m]: ideal policy',
    'after update 1',
    'last driver',
    'trained on it',
    'share',
    'falls: ideal',
    'last',
    'J/m: ideal',
    'last',
    'trained on it',
    'robot time [s]',
    'from scratch [s]',
    'one-step MSE',
    '0.3 s MSE',
    'left the data (on model and network)',
)
PERIOD = 0.03
DRAWS = 10_000
"""Of the bootstrap over seeds."""


def table(cases: Sequence[Case], rows: Sequence[Row]) -> str:
    """One line per gap and repair; mean and 95 % interval over the seeds."""
    return markdown(HEADS, [_cells(lines) for lines in grouped(cases, rows, group).values()])


def figure(title: str, cases: Sequence[Case], rows: Sequence[Row], path: Path) -> None:
    """Distance on the real robot by round, and the path of the centre of mass there."""
    drawing = Figure(figsize=(WIDTH, 1.9 * HEIGHT), layout='constrained')
    upper, lower = drawing.subplots(2, 1)
    groups = grouped(cases, rows, group)
    for name, lines in groups.items():
        _rounds(upper, ' '.join(name), lines)
    _trained_there(upper, [line for lines in groups.values() for line in lines])
    upper.set(xlabel='update of the difference model', ylabel='distance in 20 s [m]', title=title)
    upper.set_xticks(range(1 + max(case.updates for case in cases)))
    first = next(iter(groups.values()))[0]
    for label, points in zip(('ideal policy', 'last driver'), first['paths'], strict=True):
        lower.plot(*np.array(points).T, label=label)
    lower.set(
        xlabel='x [m]',
        ylabel='z [m]',
        title=f'centre of mass on the real robot, first 3 s, seed {first["seed"]}',
    )
    upper.legend(loc='upper center', bbox_to_anchor=(0.5, -0.15), ncols=3, frameon=False)
    lower.legend(frameon=False)
    for axes in (upper, lower):
        axes.spines[['top', 'right']].set_visible(False)
    drawing.savefig(path, dpi=DPI)


def _trained_there(axes: Any, lines: Sequence[Row]) -> None:
    """Mean distance of the policies trained on the real robot, each seed once."""
    of_seed = {line['seed']: line['reference'] for line in lines if 'reference' in line}
    if of_seed:
        mean = float(np.mean(_nominal(of_seed.values(), 'distance')))
        axes.axhline(mean, color='0.5', linestyle='--', label='trained on the real robot')


def group(case: Case) -> tuple[str, str]:
    """What a case shares with those that differ by seed alone."""
    return case.gap, case.repair


def share(lines: Sequence[Row]) -> tuple[float, float, float]:
    """Mean distance of the last drivers over that of policies trained on the real robot.

    Returns:
        the share and its 95 % interval by a bootstrap over the seeds.
    """
    ours = np.array(_nominal(_drivers(lines), 'distance'))
    theirs = np.array(_nominal((line['reference'] for line in lines), 'distance'))
    drawn = np.random.default_rng(0).integers(len(lines), size=(DRAWS, len(lines)))
    shares = ours[drawn].mean(axis=1) / theirs[drawn].mean(axis=1)
    low, high = np.quantile(shares, [0.025, 0.975])
    return float(ours.mean() / theirs.mean()), float(low), float(high)


def from_scratch(line: Row) -> float | None:
    """Robot time [s] until a training on the real robot tests as well as the last driver.

    None where it never does.
    """
    wanted = line['rounds'][line['driver']][0]['return']
    reached = [steps for steps, result in line['reference_curve'] if result >= wanted]
    return PERIOD * reached[0] if reached else None


def _rounds(axes: Any, name: str, lines: Sequence[Row]) -> None:
    rounds = range(min(len(line['rounds']) for line in lines))
    each = np.array([[line['rounds'][k][0]['distance'] for k in rounds] for line in lines])
    [mean] = axes.plot(rounds, each.mean(axis=0), marker='o', label=f'{name} (n = {len(lines)})')
    axes.plot(rounds, each.T, color=mean.get_color(), lw=0.6, alpha=0.5)


def _cells(lines: Sequence[Row]) -> list[str]:
    ideal, drivers = [line['rounds'][0] for line in lines], _drivers(lines)
    second = [line['rounds'][min(1, len(line['rounds']) - 1)] for line in lines]
    real = [line['reference'] for line in lines if 'reference' in line]
    return [
        lines[0]['gap'],
        lines[0]['repair'],
        ' '.join(str(line['seed']) for line in lines),
        *(_interval(_nominal(walks, 'distance')) for walks in (ideal, second, drivers, real)),
        '{:.3f} ({:.3f} to {:.3f})'.format(*share(lines)) if real else '',
        *(f'{sum(_nominal(walks, "fell"))} of {len(lines)}' for walks in (ideal, drivers)),
        *(_cost(walks) for walks in (ideal, drivers, real)),
        f'{np.mean([line["samples"] for line in lines]) * PERIOD:.0f}',
        _scratch(lines),
        *(_error(lines, steps) for steps in (1, 10)),
        _left(lines),
    ]


def _drivers(lines: Sequence[Row]) -> list[list[Row]]:
    return [line['rounds'][line['driver']] for line in lines]


def _nominal(walks: Iterable[Sequence[Row]], key: str) -> list[Any]:
    return [each[0][key] for each in walks]


def _interval(values: Sequence[float]) -> str:
    if not values:
        return ''
    mean, half = mean_and_half(np.array(values))
    return f'{mean:.2f}' if np.isnan(half) else f'{mean:.2f} ± {half:.2f}'


def _cost(walks: Iterable[Sequence[Row]]) -> str:
    known = [cost for cost in _nominal(walks, 'energy_per_metre') if cost is not None]
    return f'{np.mean(known):.1f}' if known else ''


def _scratch(lines: Sequence[Row]) -> str:
    times = [from_scratch(line) for line in lines if 'reference_curve' in line]
    return ', '.join('never' if time is None else f'{time:.0f}' for time in times)


def _error(lines: Sequence[Row], steps: int) -> str:
    pairs = [
        [line['errors'][f'mse_{name}_{steps}'] for name in ('before', 'after')] for line in lines
    ]
    known = [pair for pair in pairs if None not in pair]
    return '{:.3g} -> {:.3g}'.format(*np.mean(known, axis=0)) if known else ''


def _left(lines: Sequence[Row]) -> str:
    """Of the ideal policy and of the last driver: at what time and where, seed by seed."""

    def words(left: Row) -> str:
        return 'never' if left['seconds'] is None else f'{left["seconds"]:.2f} s {left["channel"]}'

    return '; '.join(' / '.join(words(left) for left in line['left']) for line in lines)
