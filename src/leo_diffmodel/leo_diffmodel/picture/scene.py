# SPDX-License-Identifier: Apache-2.0
"""One pose on a canvas: ground or mount, links, sticks, joints, contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .canvas import Canvas, mixed
from .palette import GRID, INK, MUTED, PAPER, TOUCH
from .stick import Pose, Stick

GROUND = '#eef1f4'
TICK = 0.1
"""Distance between the marks on the ground [m]."""


@dataclass(frozen=True)
class View:
    """From metres to pixels: `centre` (2,) m lies at `middle` (2,) px."""

    centre: np.ndarray
    middle: np.ndarray
    scale: float
    left: float
    right: float
    bottom: float

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 2) m in px."""
        return np.asarray(self.middle + (points - self.centre) * (self.scale, -self.scale))

    def metres(self, x: float) -> float:
        """The place along the first axis of a column of pixels."""
        return float(self.centre[0] + (x - self.middle[0]) / self.scale)


def draw_surroundings(canvas: Canvas, view: View, stick: Stick) -> None:
    """The ground under a walker, the mount of a fixed robot."""
    if stick.ground is not None:
        draw_ground(canvas, view, stick.ground)
    elif stick.root is not None:
        draw_mount(canvas, view, stick.root)


def draw_ground(canvas: Canvas, view: View, slope: float) -> None:
    """The floor with a mark each 0.1 m, a longer one each 0.5 m."""
    ends = np.array([view.metres(view.left), view.metres(view.right)])
    line = view.pixels(np.stack([ends, np.tan(slope) * ends], axis=1))
    below = np.array([[view.right, view.bottom], [view.left, view.bottom]])
    canvas.area(np.concatenate([line, below]), GROUND)
    for mark in np.arange(np.ceil(ends[0] / TICK), np.floor(ends[1] / TICK) + 1):
        x = float(mark) * TICK + 0.0
        foot = view.pixels(np.array([x, np.tan(slope) * x]))
        length = 10 if mark % 5 == 0 else 5
        canvas.line(np.stack([foot, foot + (0, length)]), mixed(MUTED, GROUND, 0.3), 1)
        if mark % 5 == 0 and view.left + 16 < foot[0] < view.right - 16:
            canvas.text((foot[0], foot[1] + 13), f'{x:g} m', MUTED, 11, 'ma')
    canvas.line(line, MUTED, 1.5)


def draw_mount(canvas: Canvas, view: View, root: np.ndarray) -> None:
    """Where a fixed base is bolted on."""
    x, y = view.pixels(root)
    canvas.area(
        np.array([[x - 22, y - 4], [x + 22, y - 4], [x + 22, y + 4], [x - 22, y + 4]]), GRID
    )


def draw_pose(canvas: Canvas, view: View, pose: Pose) -> None:
    """A pose in full colour."""
    for corners, colour in pose.outlines:
        canvas.area(view.pixels(corners), mixed(colour, PAPER, 0.72), mixed(colour, PAPER, 0.45))
    for line, colour in pose.sticks:
        canvas.line(view.pixels(line), colour, 3.5)
    for hinge in view.pixels(pose.hinges):
        canvas.disc(hinge, 4.2, PAPER, INK, 1.6)
    for place in view.pixels(pose.touched):
        canvas.disc(place, 5.4, TOUCH)


def draw_ghost(canvas: Canvas, view: View, pose: Pose, faint: float) -> None:
    """The sticks of an earlier pose."""
    for line, colour in pose.sticks:
        canvas.line(view.pixels(line), mixed(colour, PAPER, faint), 1.5)
