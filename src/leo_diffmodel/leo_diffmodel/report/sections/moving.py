# SPDX-License-Identifier: Apache-2.0
"""The worst predicted window as moving stick figures: the robot, the model before and after."""

from typing import Any

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.stick import Stick
from leo_diffmodel.report.page import models, Section
from leo_diffmodel.report.worst import Stretch
from leo_sim.description.robot import Robot

MODELS = palette.GIVEN, palette.Stroke(palette.AFTER, 'dotdash')
SLOWER = 4  # times slower than the robot was: a window is a second long
MOST_FRAMES = 100
FARTHEST = 3.0
"""Of the robot's size about where it was measured; a model that runs away leaves the picture."""
MARGIN = 0.08
DASHES = {'solid': (), 'dashed': (3.0, 1.5), 'dotdash': (0.7, 1.5, 3.0, 1.5)}
"""In widths of a line."""


def section(stretch: Stretch, robot: Robot, title: str) -> Section:
    """Stick figures of one window, drawn by a few lines of script that need no library."""
    stick = Stick(robot)
    chosen = np.unique(np.linspace(0, len(stretch.time) - 1, MOST_FRAMES).astype(int))
    sticks = [[stick.lines(q) for q in motion[chosen]] for motion in stretch.motion]
    low, high = _frame(sticks[0])
    legend = [('measured', palette.MEASURED), *models(*MODELS[: len(sticks) - 1])]
    films = [[_path(lines, low, high) for lines in frames] for frames in sticks]
    seconds = stretch.time[chosen] - stretch.time[0]
    width = float(0.008 * max(high - low))
    values: dict[str, Any] = {
        'title': title,
        'legend': legend,
        'box': ' '.join(f'{v:.4g}' for v in (low[0], -high[1], *(high - low))),
        'width': width,
        'dashes': {n: ' '.join(f'{d * width:.3g}' for d in dash) for n, dash in DASHES.items()},
        'root': None if stick.root is None else (stick.root[0], -stick.root[1]),
        'ground': None if stick.ground is None else _ground(stick.ground, low, high),
        'film': {'times': np.round(seconds, 3).tolist(), 'films': films},
        'slower': SLOWER,
    }
    return Section('moving.html', values)


def _frame(measured: list[list[Array]]) -> tuple[Array, Array]:
    """Lowest and highest corner of the picture [m]: where the robot was, and some room."""
    corners = np.concatenate([points for lines in measured for points in lines])
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = MARGIN * max(high - low)
    return low - room, high + room


def _path(lines: list[Array], low: Array, high: Array) -> str:
    size = FARTHEST * (high - low)
    path = ''
    for points in lines:
        near = np.clip(points, low - size, high + size)
        path += 'M' + 'L'.join(f'{x:.4g} {-y:.4g}' for x, y in near)
    return path


def _ground(slope: float, low: Array, high: Array) -> str:
    return 'M' + 'L'.join(f'{x:.4g} {-np.tan(slope) * x:.4g}' for x in (low[0], high[0]))
