# SPDX-License-Identifier: Apache-2.0
"""Colours that stay apart for colour-blind readers (Okabe and Ito) and in grey print."""

from typing import NamedTuple


class Stroke(NamedTuple):
    """How a series is drawn: its colour, and a bokeh dash or `points`, so that two differ."""

    colour: str
    dash: str = 'solid'


INK = '#1b2733'
MUTED = '#5b6775'
GRID = '#e4e8ec'
PAPER = '#ffffff'
NOISE = '#7c8794'
NOISE_FILL = '#e9ecf0'
BEFORE = '#d55e00'
AFTER = '#0072b2'
UNEXPLAINED = '#e69f00'
TOUCH = '#009e73'
"""Where a foot is on the ground."""
MEASURED, GIVEN, REPAIRED = Stroke(INK), Stroke(BEFORE, 'dashed'), Stroke(AFTER)
"""The robot, the model as given, and with what was added."""
FLOOR = Stroke(NOISE, 'dashed')
CANDIDATES = (
    REPAIRED,
    Stroke('#009e73', 'dashed'),
    Stroke('#b8548f', 'dotdash'),
    Stroke('#8a6d00', 'dotted'),
)
EFFECTS = (AFTER, '#009e73', '#b8548f', '#56b4e9', '#004b76')
