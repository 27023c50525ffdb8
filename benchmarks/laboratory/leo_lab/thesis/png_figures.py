# SPDX-License-Identifier: Apache-2.0
"""Figures of the experiments as PNG files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure
import numpy as np

from leo_lab.thesis.summary import common_curves, mean_and_half, Row

WIDTH, HEIGHT, DPI = 7.2, 4.2, 110
FEWEST = 3
"""Seeds whose mean has a band; that of two would cover the picture."""


def learning_curves(
    groups: Mapping[str, Sequence[Row]], title: str, path: Path, linear: float | None = None
) -> None:
    """Test return against transitions: every seed, their mean with its 95 % band, n.

    Args:
        groups: lines by the name of their group.
        title: of the figure.
        path: of the PNG.
        linear: returns below minus this are drawn by their logarithm.
    """
    figure = Figure(figsize=(WIDTH, HEIGHT + 0.12 * len(groups)), layout='constrained')
    axes = figure.add_subplot()
    low, high = 0.0, 0.0
    for name, rows in groups.items():
        steps, table = common_curves(rows)
        mean, half = np.array([mean_and_half(column) for column in table.T]).reshape(-1, 2).T
        [line] = axes.plot(steps / 1000, mean, label=f'{name} (n = {len(rows)})')
        colour = line.get_color()
        axes.plot(steps / 1000, table.T, color=colour, lw=0.5, alpha=0.5)
        if len(rows) >= FEWEST:
            axes.fill_between(
                steps / 1000, mean - half, mean + half, alpha=0.15, color=colour, lw=0
            )
        low, high = min(low, table.min(initial=0.0)), max(high, table.max(initial=0.0))
    room = 0.05 * (high - low)
    axes.set(
        xlabel='transitions [thousands]',
        ylabel='test return',
        title=title,
        ylim=(low - room, high + room),
    )
    if linear is not None:
        axes.set_yscale('symlog', linthresh=linear)
        ticks = [t for t in (0.0, *(-linear * 10.0**k for k in range(4))) if t >= low]
        axes.set_yticks(ticks, [f'{t:g}' for t in ticks])
        axes.set_ylim(top=high + 0.1 * linear)
    axes.axhline(0, color='0.7', lw=0.8, zorder=0)
    figure.legend(loc='outside lower center', ncols=2, frameon=False)
    axes.spines[['top', 'right']].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
