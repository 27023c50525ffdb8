# SPDX-License-Identifier: Apache-2.0
"""The last seconds of one state and of the inputs, as strips that end now."""

from __future__ import annotations

from bokeh.layouts import column
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure
from markupsafe import Markup
import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas
from leo_diffmodel.watch.page.look import GIVEN, legend, MEASURED, REPAIRED, said
from leo_diffmodel.watch.state import State

Array = np.ndarray
HEIGHT = 170
UNITS = {'voltage': 'V', 'torque': 'N m', 'position': 'rad', 'none': ''}
COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9')


class StripsView:
    """Measured and predicted state above what was applied."""

    def __init__(self, state: State) -> None:
        self._state = state
        self._measured = ColumnDataSource({'t': [], 'x': []}, name='live measured')
        self._ahead = ColumnDataSource({'t': [], 'given': [], 'now': []}, name='live predicted')
        self._inputs = ColumnDataSource(
            {'ts': [], 'us': [], 'colour': [], 'joint': []}, name='live inputs'
        )
        self._upper = self._states()
        self._lower = self._applied()
        names = ('measured', MEASURED), ('as given', GIVEN), ('with the switches', REPAIRED)
        words = said(legend(*names))
        joints = said(joints_legend(state.scene.recordings[-1].actuators))
        self.root = column(words, self._upper, self._lower, joints, sizing_mode='stretch_width')

    def refresh(self) -> None:
        """Draw the data of now."""
        state, i = self._state, self._state.shown
        recording, film = state.scene.recordings[-1], state.film
        t, x, inputs = joined(recording)
        end = t[-1]
        self._measured.data = {'t': t - end, 'x': x[:, i]}
        first = recording.episodes[0].t[0]
        self._ahead.data = {
            't': _with_gaps(film.time + first - end),
            'given': _with_gaps(film.given[..., i]),
            'now': _with_gaps(film.repaired[..., i]),
        }
        self._inputs.data = stepped(t - end, inputs, recording.actuators)
        shown = state.states[i]
        self._upper.yaxis.axis_label = f'{shown["name"]} [{shown["unit"]}]'

    def _states(self) -> figure:
        plot = canvas('', '', height=HEIGHT, name='live states')
        for name, stroke in (('given', GIVEN), ('now', REPAIRED)):
            plot.line(
                't',
                name,
                source=self._ahead,
                line_color=stroke.colour,
                line_width=2,
                line_dash=stroke.dash,
            )
        plot.line('t', 'x', source=self._measured, line_color=palette.INK, line_width=1.5)
        return plot

    def _applied(self) -> figure:
        kind = self._state.scene.recordings[-1].input
        plot = canvas(
            'before the newest sample [s]',
            f'applied [{UNITS[kind]}]',
            height=HEIGHT,
            x_range=self._upper.x_range,
            name='live applied',
        )
        plot.multi_line('ts', 'us', source=self._inputs, line_color='colour', line_width=1.5)
        return plot


def joined(recording: Recording) -> tuple[Array, Array, Array]:
    """Times (T,), states (T, 2J) and inputs (T, A) of all episodes; NaN between two."""
    parts = [
        (e.t, np.hstack([e.q, e.dq]), np.where(e.enabled, e.inputs, np.nan))
        for e in recording.episodes
    ]
    gaps = [
        (t[-1:], np.full_like(x[:1], np.nan), np.full_like(u[:1], np.nan))
        for t, x, u in parts[:-1]
    ]
    rows = [row for pair in zip(parts, [*gaps, parts[-1]], strict=True) for row in pair][:-1]
    t, x, u = (np.concatenate(column) for column in zip(*rows, strict=True))
    return t, x, u


def _with_gaps(windows: Array) -> Array:
    """Windows (W, K+1) one after the other, NaN after each."""
    gap = np.full((len(windows), 1), np.nan)
    return np.concatenate([windows, gap], axis=1).ravel()


def joints_legend(joints: tuple[str, ...]) -> Markup:
    """Which line is whose, as HTML."""
    return legend(*((name, Stroke(colour(k), 'solid')) for k, name in enumerate(joints)))


def colour(k: int) -> str:
    """Of the line of one joint."""
    return COLOURS[k % len(COLOURS)]


def stepped(t: Array, inputs: Array, joints: tuple[str, ...]) -> dict[str, list]:
    """A stepped line for each actuator."""
    times = np.repeat(t, 2)[1:]
    return {
        'ts': [times] * len(joints),
        'us': [np.repeat(u, 2)[:-1] for u in inputs.T],
        'colour': [colour(k) for k in range(len(joints))],
        'joint': [*joints],
    }
