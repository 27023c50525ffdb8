# SPDX-License-Identifier: Apache-2.0
"""A drawing with smooth edges, and a robot's pose on it with its ground or mount."""

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageColor, ImageDraw, ImageFont

from .palette import GRID, INK, MUTED, PAPER, TOUCH
from .stick import Pose, Stick

GROUND = '#eef1f4'
TICK = 0.1  # distance between the marks on the ground [m]


class Canvas:
    """Shapes and text, in pixels of the picture; drawn `fine` times larger, and shrunk."""

    def __init__(self, width: int, height: int, fine: int = 3):
        self.width, self.height, self._fine = width, height, fine
        self._image = Image.new('RGB', (width * fine, height * fine), PAPER)
        self._draw = ImageDraw.Draw(self._image)

    def line(self, points: np.ndarray, colour: str, width: float) -> None:
        """A line through points (N, 2) with round ends and corners."""
        points = np.asarray(points, dtype=float)
        self._draw.line(self._large(points), fill=colour, width=self._thick(width))
        for point in points:
            self.disc(point, width / 2, colour)

    def area(self, corners: np.ndarray, colour: str, edge: str = '') -> None:
        self._draw.polygon(self._large(corners), fill=colour)
        if edge:
            self.line(np.concatenate([corners, corners[:1]]), edge, 1)

    def box(self, left: float, top: float, right: float, bottom: float, colour: str) -> None:
        self.area(np.array([[left, top], [right, top], [right, bottom], [left, bottom]]), colour)

    def disc(
        self, centre: np.ndarray, radius: float, colour: str, edge: str = '', width: float = 0
    ) -> None:
        """A filled circle; the edge is drawn inside."""
        x, y, r = (value * self._fine for value in (centre[0], centre[1], radius))
        outline, thick = edge or None, self._thick(width) if edge else 0
        self._draw.ellipse((x - r, y - r, x + r, y + r), colour, outline, thick)

    def text(
        self, place: tuple[float, float], text: str, colour: str, size: int, anchor: str = 'la'
    ) -> None:
        """Words at a place; anchors as Pillow names them."""
        font = ImageFont.load_default(size * self._fine)
        x, y = (value * self._fine for value in place)
        self._draw.text((x, y), text, fill=colour, font=font, anchor=anchor)

    def finished(self) -> Image.Image:
        return self._image.resize((self.width, self.height), Image.Resampling.LANCZOS)

    def _large(self, points: np.ndarray) -> list[tuple[float, float]]:
        return [(float(x) * self._fine, float(y) * self._fine) for x, y in points]

    def _thick(self, width: float) -> int:
        return max(1, round(width * self._fine))


def mixed(colour: str, other: str, share: float) -> str:
    a, b = (np.array(ImageColor.getrgb(c)[:3], float) for c in (colour, other))
    red, green, blue = ((1 - share) * a + share * b).round().astype(int)
    return f'#{red:02x}{green:02x}{blue:02x}'


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
        return float(self.centre[0] + (x - self.middle[0]) / self.scale)


def draw_surroundings(canvas: Canvas, view: View, stick: Stick) -> None:
    if stick.ground is not None:
        _draw_ground(canvas, view, stick.ground)
    elif stick.root is not None:
        draw_mount(canvas, view, stick.root)


def _draw_ground(canvas: Canvas, view: View, slope: float) -> None:
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
    x, y = view.pixels(root)
    canvas.box(x - 22, y - 4, x + 22, y + 4, GRID)


def draw_pose(canvas: Canvas, view: View, pose: Pose) -> None:
    for corners, colour in pose.outlines:
        canvas.area(view.pixels(corners), mixed(colour, PAPER, 0.72), mixed(colour, PAPER, 0.45))
    for line, colour in pose.sticks:
        canvas.line(view.pixels(line), colour, 3.5)
    for hinge in view.pixels(pose.hinges):
        canvas.disc(hinge, 4.2, PAPER, INK, 1.6)
    for place in view.pixels(pose.touched):
        canvas.disc(place, 5.4, TOUCH)


def draw_ghost(canvas: Canvas, view: View, pose: Pose, faint: float) -> None:
    for line, colour in pose.sticks:
        canvas.line(view.pixels(line), mixed(colour, PAPER, faint), 1.5)
