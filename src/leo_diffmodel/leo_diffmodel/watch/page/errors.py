# SPDX-License-Identifier: Apache-2.0
"""The error of both models: against horizon as figures and curves, and over time."""

from typing import Any

from bokeh.events import Tap
from bokeh.models import ColumnDataSource, Select, Span
from markupsafe import Markup
import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.report.canvas import canvas
from leo_diffmodel.report.sections.horizon import frame, horizon_canvas
from leo_diffmodel.watch import view
from leo_diffmodel.watch.page import look
from leo_diffmodel.watch.page.look import legend, renew, ROBOTS, said, small, WIDE
from leo_diffmodel.watch.state import State
from leo_diffmodel.watch.view import MODELS

FLOOR = ('noise floor', palette.FLOOR)
HEIGHT, LOW = 340, 210  # of the plots against horizon and over time [px]
NEAR = 0.015  # a tap this near to a worst window, as a share of all time, is meant for it
NOTE = (
    'Rms error over each stretch that is predicted from its measured start. Marked: the worst '
    'with the switches as they are; a tap goes there. Shaded: held out, no value is read from it.'
)


class HorizonView:
    """The curve of one state, chosen here for all figures, below the error as figures."""

    def __init__(self, state: State) -> None:
        self._state = state
        self._source = ColumnDataSource(view.against_horizon(state), name='error against horizon')
        size = {'height': HEIGHT, 'name': 'horizon plot'}
        self.plot = horizon_canvas(self._source, {n: s for n, s, _ in MODELS}, **size)
        names = [f'{s["name"]} [{s["unit"]}]' for s in state.states]
        options = [(str(i), name) for i, name in enumerate(names)]
        shown = Select(options=options, value='0', title='error of', width=160, name='shown')
        self._shown = look.following(shown, lambda v: state.show(int(v)))
        self._words = said(words(state), **WIDE, name='error')
        head = look.wrapped((shown, 160), (self._words, look.WORDS))
        self.root = look.card(head, self.plot, said(legend(*ROBOTS[1:], FLOOR)))
        self.refresh()

    def refresh(self) -> None:
        renew(self._source, view.against_horizon(self._state))
        frame(self.plot, view.unit(self._state), *view.heights(self._source.data))
        self._shown.value = str(self._state.shown)

    def say(self) -> None:
        """The figures. New text lays the page out anew, which takes longer."""
        self._words.text = words(self._state)


def words(state: State) -> Markup:
    """The held-out error of now, as HTML: in noise floors, and of the state that is shown."""
    (before, after, noise), i = state.sizes, state.shown
    unit, kind = state.states[i]['unit'], state.scene.headline
    figures = state.given.figures[i], state.now.figures[i], state.floor.floor[i]
    first, last, floor = (f'{v:.3g}' for v in figures)
    head = Markup('<b class="big">{}</b> noise floors, held out, {}<br>').format(
        f'{before:.2f} → {after:.2f}', kind.short
    )
    return head + small(
        f'{state.states[i]["name"]}: {first} → {last} {unit}, noise floor {floor}; '
        f'a perfect model scores {noise:.2f} noise floors'
    )


class OverTimeView:
    def __init__(self, state: State) -> None:
        self._state = state
        self._curve = ColumnDataSource(view.over_time(state), name='error over time')
        self._marks = ColumnDataSource(view.worst(state), name='worst windows')
        self._cursor = Span(location=0.0, dimension='height', line_color=palette.INK)
        self._held = ColumnDataSource(view.held(state), name='held out')
        self.plot = self._plot()
        self.plot.on_event(Tap, lambda event: state.go(self._meant(event.x)))
        self.root = look.card(self.plot, look.note(NOTE))
        self.refresh()

    def refresh(self) -> None:
        renew(self._curve, view.over_time(self._state))
        renew(self._marks, view.worst(self._state))
        self.plot.yaxis.axis_label = view.unit(self._state)
        renew(self._held, view.held(self._state))
        self.tick()

    def tick(self) -> None:
        self._cursor.location = self._state.player.now

    def _plot(self) -> Any:
        plot = canvas('time, one bag after the other [s]', '', height=LOW, name='time plot')
        band = {'fill_color': palette.NOISE_FILL, 'line_color': None, 'level': 'underlay'}
        plot.vstrip('begin', 'end', source=self._held, **band)
        steps = {'source': self._curve, 'mode': 'center', 'line_width': 2}
        for name, stroke, _ in MODELS:
            plot.step('time', name, line_color=stroke.colour, **steps)
        marks = {'size': 12, 'color': palette.UNEXPLAINED, 'line_color': palette.INK}
        plot.scatter('time', 'error', source=self._marks, marker='inverted_triangle', **marks)
        plot.add_layout(self._cursor)
        plot.y_range.start = 0.0
        return plot

    def _meant(self, seconds: float) -> float:
        marks = np.asarray(self._marks.data['time'])
        nearest = int(np.argmin(np.abs(marks - seconds)))
        near = abs(marks[nearest] - seconds) < NEAR * self._state.player.length
        return float(self._marks.data['apart'][nearest]) if near else seconds
