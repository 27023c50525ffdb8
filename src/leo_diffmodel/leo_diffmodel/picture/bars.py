# SPDX-License-Identifier: Apache-2.0
"""Which foot was on the ground when, as bars over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .canvas import Canvas
from .palette import GRID, MUTED, TOUCH
from .take import Take

BAR = 20
"""Height of a foot's row [px]."""


def draw_feet(
    canvas: Canvas, shown: Take, box: tuple[float, float, float], marks: Sequence[float]
) -> None:
    """A row per foot, filled while it touches; vertical lines at `marks` [s].

    Args:
        canvas: to draw on.
        shown: whose feet.
        box: left, top and right [px].
        marks: times.
    """
    left, top, right = box
    span = max(shown.end - shown.start, 1e-9)

    def column(time: float) -> float:
        return left + (right - left) * (time - shown.start) / span

    for number, (foot, touching) in enumerate(shown.feet):
        y = top + number * BAR
        canvas.text((left - 10, y + 6), foot.replace('_', ' '), MUTED, 12, 'rm')
        canvas.area(_box(left, y, right, y + 12), GRID)
        for start, end in _stretches(shown, touching):
            canvas.area(_box(column(start), y, column(end), y + 12), TOUCH)
    bottom = top + len(shown.feet) * BAR - 5
    for time in marks:
        canvas.line(np.array([[column(time), top - 4], [column(time), bottom]]), MUTED, 1)


def _stretches(shown: Take, touching: np.ndarray) -> list[tuple[float, float]]:
    """From when to when a foot touches [s], within what is shown."""
    t = shown.episode.t
    edges = np.flatnonzero(np.diff(np.concatenate([[0], touching.astype(int), [0]])))
    ends = [min(int(edge), len(t) - 1) for edge in edges]
    spans = np.clip(t[ends].reshape(-1, 2), shown.start, shown.end)
    return [(float(a), float(b)) for a, b in spans if b > a]


def _box(left: float, top: float, right: float, bottom: float) -> np.ndarray:
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
