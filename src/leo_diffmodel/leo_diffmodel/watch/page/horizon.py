# SPDX-License-Identifier: Apache-2.0
"""Rms error against horizon: as given and with the switches, over the noise floor."""

from __future__ import annotations

from typing import Any

from bokeh.layouts import column, row
from bokeh.models import ColumnDataSource, FixedTicker, PrintfTickFormatter, Range1d, Select
from markupsafe import Markup

from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas, hover, ticks
from leo_diffmodel.watch import curves
from leo_diffmodel.watch.page.look import CARD, GIVEN, legend, REPAIRED, said, small
from leo_diffmodel.watch.page.part import renew
from leo_diffmodel.watch.score import told
from leo_diffmodel.watch.state import State

FLOOR = Stroke(palette.NOISE, 'dashed')
HEIGHT = 340


class ErrorWords:
    """The held-out error as figures. New text lays the page out anew, which takes longer."""

    def __init__(self, state: State) -> None:
        self._state = state
        self.root = said(words(state), sizing_mode='stretch_width', name='error')

    def refresh(self) -> None:
        """Say the figures of now."""
        self.root.text = words(self._state)


class HorizonView:
    """The curve of one state, which is chosen here for the other figures as well.

    Attributes:
        words: the figures above the curve, a part of their own.
    """

    def __init__(self, state: State) -> None:
        self._state = state
        self._source = ColumnDataSource(
            curves.against_horizon(state), name='error against horizon'
        )
        self._ticker = FixedTicker()
        self.plot = self._plot()
        names = [f'{s["name"]} [{s["unit"]}]' for s in state.states]
        options = [(str(i), name) for i, name in enumerate(names)]
        self._shown = Select(options=options, value='0', title='error of', width=160, name='shown')
        self._shown.on_change('value', lambda _, __, v: state.show(int(v)))
        self.words = ErrorWords(state)
        strokes = ('as given', GIVEN), ('with the switches', REPAIRED), ('noise floor', FLOOR)
        self.root = column(
            row(self._shown, self.words.root, sizing_mode='stretch_width'),
            self.plot,
            said(legend(*strokes)),
            stylesheets=[CARD],
            sizing_mode='stretch_width',
        )
        self.refresh()

    def refresh(self) -> None:
        """Draw the curves of now."""
        renew(self._source, curves.against_horizon(self._state))
        self._frame()
        self._shown.value = str(self._state.shown)

    def _plot(self) -> Any:
        plot = canvas(
            'prediction horizon [s]',
            '',
            x_axis_type='log',
            y_axis_type='log',
            height=HEIGHT,
            name='horizon plot',
        )
        plot.y_range = Range1d(1e-3, 1.0)
        plot.varea('seconds', 1e-12, 'floor', source=self._source, color=palette.NOISE_FILL)
        for name, stroke, width in (
            ('floor', FLOOR, 1.5),
            ('given', GIVEN, 2.5),
            ('now', REPAIRED, 2.5),
        ):
            look = {'source': self._source, 'color': stroke.colour}
            plot.line('seconds', name, line_width=width, line_dash=stroke.dash, **look)
            if name != 'floor':
                dots = plot.scatter('seconds', name, size=7, **look)
                hover(
                    plot,
                    dots,
                    [(name, f'@{name}{{0.000e}}'), ('floor', '@floor{0.000e}'), ('s', '@seconds')],
                )
        plot.axis.formatter = PrintfTickFormatter(format='%g')
        seconds = self._source.data['seconds']
        plot.xaxis.ticker, plot.yaxis.ticker = ticks(min(seconds), max(seconds)), self._ticker
        return plot

    def _frame(self) -> None:
        """The axes: all that is no smaller than a part of the floor."""
        bottom, top = curves.heights(self._source.data)
        self.plot.y_range.update(start=bottom, end=top)
        self._ticker.ticks = ticks(bottom, top)
        self.plot.yaxis.axis_label = f'rms error of {curves.unit(self._state)}'


def words(state: State) -> Markup:
    """The held-out error of now, as HTML: in noise floors, and of the state that is shown."""
    (before, after), i = state.sizes, state.shown
    unit, kind = state.states[i]['unit'], told(state.scene)
    figures = state.given.figures[i], state.now.figures[i], state.floor.floor[i]
    first, last, floor = (f'{v:.3g}' for v in figures)
    head = Markup('<b class="big">{}</b> noise floors, held out, {}<br>').format(
        f'{before:.2f} → {after:.2f}', kind.short
    )
    return head + small(
        f'{state.states[i]["name"]}: {first} → {last} {unit}, noise floor {floor}; '
        'a perfect model scores 1 noise floor'
    )
