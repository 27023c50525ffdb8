# SPDX-License-Identifier: Apache-2.0
"""The error over time, the worst windows marked; a tap goes there."""

from __future__ import annotations

from typing import Any

from bokeh.events import Tap
from bokeh.layouts import column
from bokeh.models import BoxAnnotation, ColumnDataSource, Span
import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.report.canvas import canvas
from leo_diffmodel.watch import curves
from leo_diffmodel.watch.page.look import CARD, GIVEN, REPAIRED, said, small
from leo_diffmodel.watch.page.part import renew
from leo_diffmodel.watch.state import State

HEIGHT = 210
NEAR = 0.015
"""A tap this near to a worst window, as a share of all time, is meant for it."""
NOTE = (
    'Rms error over each stretch that is predicted from its measured start. Marked: the worst '
    'with the switches as they are; a tap goes there. Shaded: held out, no value is read from it.'
)


class OverTimeView:
    """The error of both models in each window of the film."""

    def __init__(self, state: State) -> None:
        self._state = state
        self._curve = ColumnDataSource(curves.over_time(state), name='error over time')
        self._marks = ColumnDataSource(curves.worst(state), name='worst windows')
        self._cursor = Span(location=0.0, dimension='height', line_color=palette.INK)
        self._film = state.film
        self.plot = self._plot()
        note = said(small(NOTE), sizing_mode='stretch_width')
        self.root = column(self.plot, note, stylesheets=[CARD], sizing_mode='stretch_width')
        self.refresh()

    def refresh(self) -> None:
        """Draw the errors of now."""
        renew(self._curve, curves.over_time(self._state))
        renew(self._marks, curves.worst(self._state))
        self.plot.yaxis.axis_label = curves.unit(self._state)
        if self._film.time.shape != self._state.film.time.shape:
            self._film = self._state.film
            self.plot.center = [r for r in self.plot.center if not _is_shade(r)]
            self._shade(self.plot)
        self.tick()

    def follow_taps(self) -> None:
        """Go where one taps; a copy of the page has nobody to ask."""
        self.plot.on_event(Tap, lambda event: self._state.go(self._meant(event.x)))

    def tick(self) -> None:
        """Move the cursor to where one is."""
        self._cursor.location = self._state.player.now

    def _plot(self) -> Any:
        plot = canvas('time, one bag after the other [s]', '', height=HEIGHT, name='time plot')
        self._shade(plot)
        for name, stroke in (('given', GIVEN), ('now', REPAIRED)):
            plot.step(
                'time',
                name,
                source=self._curve,
                mode='center',
                line_width=2,
                line_color=stroke.colour,
            )
        plot.scatter(
            'time',
            'error',
            source=self._marks,
            size=12,
            marker='inverted_triangle',
            color=palette.UNEXPLAINED,
            line_color=palette.INK,
        )
        plot.add_layout(self._cursor)
        plot.y_range.start = 0.0
        return plot

    def _shade(self, plot: Any) -> None:
        """A band over every held-out window of the film."""
        for begin, end in curves.held(self._state):
            plot.add_layout(
                BoxAnnotation(
                    left=begin,
                    right=end,
                    fill_color=palette.NOISE_FILL,
                    level='underlay',
                    line_color=None,
                )
            )

    def _meant(self, seconds: float) -> float:
        """The begin of the worst window that was tapped, or the time itself."""
        marks = np.asarray(self._marks.data['time'])
        nearest = int(np.argmin(np.abs(marks - seconds)))
        near = abs(marks[nearest] - seconds) < NEAR * self._state.player.length
        return float(self._marks.data['begin'][nearest]) if near else seconds


def _is_shade(renderer: Any) -> bool:
    return isinstance(renderer, BoxAnnotation)
