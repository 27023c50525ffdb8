# SPDX-License-Identifier: Apache-2.0
"""A picture of poses side by side over time, with the feet's contacts below."""

from __future__ import annotations

import numpy as np
from PIL import Image

from .bars import BAR, draw_feet
from .canvas import Canvas
from .palette import INK
from .scene import draw_ghost, draw_pose, draw_surroundings, View
from .take import Take

WIDTH, HEAD, FOOT, SIDE = 1600, 54, 62, 24
TALLEST = 420
POSES = 8
GHOSTS = 3
"""Earlier poses drawn faintly behind each."""


def strip(shown: Take, poses: int = POSES) -> Image.Image:
    """Poses at even times; a single one when start and end are the same."""
    poses = 1 if shown.end <= shown.start else poses
    times = np.linspace(shown.start, shown.end, poses)
    low, high = shown.extent
    width = WIDTH if poses > 1 else 640
    cell = (width - 2 * SIDE) / poses
    scale = min(cell / (high[0] - low[0]), TALLEST / (high[1] - low[1]))
    tall = round(scale * (high[1] - low[1]))
    feet = shown.feet if poses > 1 else []
    canvas = Canvas(width, HEAD + tall + FOOT + BAR * len(feet) + (26 if feet else 0))
    canvas.text((SIDE, 18), shown.title, INK, 17)
    step = times[1] - times[0] if poses > 1 else 0.0
    for number, time in enumerate(times):
        left = SIDE + number * cell
        centre = left + 0.5 * (cell - scale * (low[0] + high[0]))
        middle = np.array([centre, HEAD + scale * high[1]])
        view = View(shown.followed(time), middle, scale, left, left + cell, HEAD + tall + 32)
        _draw_cell(canvas, view, shown, time, step)
        canvas.text((centre, HEAD + tall + 38), f'{time:.2f} s', INK, 14, 'ma')
    if feet:
        top = HEAD + tall + FOOT + 6
        draw_feet(canvas, shown, (SIDE + 100, top, width - SIDE), times.tolist())
    return canvas.finished()


def _draw_cell(canvas: Canvas, view: View, shown: Take, time: float, step: float) -> None:
    """One pose on its ground, the poses that led to it behind."""
    for ghost in range(GHOSTS, 0, -1):
        earlier = time - ghost * step / (GHOSTS + 1)
        if step and earlier >= shown.start:
            draw_ghost(canvas, view, shown.pose(earlier), 0.55 + 0.12 * ghost)
    draw_surroundings(canvas, view, shown.stick)
    draw_pose(canvas, view, shown.pose(time))


