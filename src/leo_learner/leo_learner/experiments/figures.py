# SPDX-License-Identifier: Apache-2.0
"""Figures of the experiments as PNG files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from leo_learner.experiments.summary import mean_curve, Row

WIDTH, HEIGHT, DPI = 7.2, 4.2, 110


def learning_curves(groups: Mapping[str, Sequence[Row]], title: str, path: Path) -> None:
    """Test return against transitions: mean over the seeds, 95 % band, n in the legend."""
    figure = Figure(figsize=(WIDTH, HEIGHT), layout='constrained')
    axes = figure.add_subplot()
    for name, rows in groups.items():
        steps, mean, half = mean_curve(rows)
        [line] = axes.plot(steps / 1000, mean, label=f'{name} (n = {len(rows)})')
        axes.fill_between(
            steps / 1000, mean - half, mean + half, alpha=0.2, color=line.get_color(), lw=0
        )
    axes.set(xlabel='transitions [thousands]', ylabel='test return', title=title)
    axes.axhline(0, color='0.7', lw=0.8, zorder=0)
    axes.legend(frameon=False)
    axes.spines[['top', 'right']].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
