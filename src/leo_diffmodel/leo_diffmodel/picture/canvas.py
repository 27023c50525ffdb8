# SPDX-License-Identifier: Apache-2.0
"""A drawing with smooth edges: everything in pixels of the finished picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageColor, ImageDraw, ImageFont

from .palette import PAPER


class Canvas:
    """Lines, areas, discs and text, drawn larger and shrunk at the end.

    Args:
        width: [px].
        height: [px].
        fine: how many times larger it is drawn.
    """

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

    def area(self, corners: np.ndarray, colour: str, edge: str = '', width: float = 1) -> None:
        """A filled polygon (N, 2)."""
        self._draw.polygon(self._large(corners), fill=colour)
        if edge:
            self.line(np.concatenate([corners, corners[:1]]), edge, width)

    def disc(
        self,
        centre: Sequence[float] | np.ndarray,
        radius: float,
        colour: str,
        edge: str = '',
        width: float = 1.5,
    ) -> None:
        """A filled circle; the edge is drawn inside."""
        x, y, r = (value * self._fine for value in (centre[0], centre[1], radius))
        self._draw.ellipse(
            (x - r, y - r, x + r, y + r),
            fill=colour,
            outline=edge or None,
            width=self._thick(width) if edge else 0,
        )

    def text(
        self, place: tuple[float, float], text: str, colour: str, size: int, anchor: str = 'la'
    ) -> None:
        """Words at a place; anchors as Pillow names them."""
        font = ImageFont.load_default(size * self._fine)
        x, y = (value * self._fine for value in place)
        self._draw.text((x, y), text, fill=colour, font=font, anchor=anchor)

    def finished(self) -> Image.Image:
        """The picture."""
        return self._image.resize((self.width, self.height), Image.Resampling.LANCZOS)

    def _large(self, points: np.ndarray) -> list[tuple[float, float]]:
        return [(float(x) * self._fine, float(y) * self._fine) for x, y in points]

    def _thick(self, width: float) -> int:
        return max(1, round(width * self._fine))


def mixed(colour: str, other: str, share: float) -> str:
    """A colour with a share (0 to 1) of another."""
    a, b = (np.array(ImageColor.getrgb(c)[:3], float) for c in (colour, other))
    red, green, blue = ((1 - share) * a + share * b).round().astype(int)
    return f'#{red:02x}{green:02x}{blue:02x}'
