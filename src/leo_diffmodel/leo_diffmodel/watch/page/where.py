# SPDX-License-Identifier: Apache-2.0
"""Where both models fail: joints and conditions by their share of the error; a tap goes there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bokeh.core.properties import value
from bokeh.events import Tap
from bokeh.layouts import column, row
from bokeh.models import ColumnDataSource, NumeralTickFormatter, Range1d
from markupsafe import Markup
import numpy as np

from leo_diffmodel.compare.where import against_motion, ranked, stands_out, Where
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas, FONT, hover
from leo_diffmodel.report.sections.where import against, in_print
from leo_diffmodel.report.text import numbered, percent
from leo_diffmodel.watch.lack import Lack
from leo_diffmodel.watch.page.look import AS_GIVEN, CARD, legend, said, small, SWITCHED, WIDE
from leo_diffmodel.watch.state import State

ROWS, MOST_JOINTS = 6, 3
HEIGHT = 268
BAR = 0.3
ABOVE = 0.38
"""How far above the middle of its bar a place is named, in rows."""
FAINT = 0.35
"""Opacity of what may be chance."""
NOTE = (
    'The torque that a model lacks, by joint and condition: the share that a place has of its '
    'mean square beyond noise, and its rms there. Pale: no more than chance makes of its time. '
    'A tap goes to the worst window.'
)
NOISE_ONLY = 'nowhere: the torque it lacks stays within its noise'
Rows = dict[str, list]
NO_ROWS: Rows = {
    name: [] for name in ('y', 'above', 'share', 'place', 'size', 'tip', 'begin', 'alpha')
}


class WhereView:
    """The model as given and that with the switches, side by side."""

    def __init__(self, state: State) -> None:
        self._state = state
        models = ('given', AS_GIVEN), ('now', SWITCHED)
        self._rankings = [_Ranking(state, *model) for model in models]
        self._words = said(name='where says', **WIDE)
        both = row(*(r.root for r in self._rankings), **WIDE)
        self.root = column(self._words, both, stylesheets=[CARD], **WIDE)
        self.refresh()

    def refresh(self) -> None:
        """Show the places of now."""
        lacks = self._state.lacks
        note = lacks.trouble or ('computing …' if lacks.behind else NOTE)
        self._words.text = Markup('<b>Where it fails</b> {}').format(small(note))
        for ranking, lack in zip(self._rankings, (lacks.given, lacks.now), strict=True):
            ranking.show(lack)

    def follow_taps(self) -> None:
        """Go to the worst window of a place where one taps."""
        for ranking in self._rankings:
            ranking.follow_taps()


class _Ranking:
    """The places of one model, worst first."""

    def __init__(self, state: State, which: str, model: tuple[str, Stroke]) -> None:
        self._state, self._head = state, legend(model)
        self._shown: Lack | None = None
        self._source = ColumnDataSource(NO_ROWS, name=f'where {which}')
        self._words = said(self._head, name=f'where {which} says', **WIDE)
        self.plot = self._plot(model[1], which)
        self.root = column(self._words, self.plot, **WIDE)

    def show(self, lack: Lack | None) -> None:
        """Draw what is new."""
        if lack is None or lack is self._shown:
            return
        self._shown = lack
        rows = _rows(self._state, lack.places)
        self._source.data, self.plot.visible = rows, bool(rows['y'])
        self._words.text = self._head + Markup('<br>') + small(_said(lack.places))

    def follow_taps(self) -> None:
        """Go to the worst window of the place that is tapped."""
        self.plot.on_event(Tap, lambda event: self._go(event.y))

    def _go(self, y: float) -> None:
        begin, number = self._source.data['begin'], round(-y)
        if 0 <= number < len(begin):
            self._state.go(begin[number])

    def _plot(self, stroke: Stroke, which: str) -> Any:
        ranges = {'x_range': Range1d(0.0, 1.0), 'y_range': Range1d(-ROWS + 0.5, 0.6)}
        name = f'where {which} plot'
        plot = canvas('share of the error', '', height=HEIGHT, name=name, **ranges)
        plot.yaxis.visible, plot.ygrid.grid_line_color = False, None
        plot.xaxis.formatter = NumeralTickFormatter(format='0 %')
        look: dict[str, Any] = {'source': self._source, 'alpha': 'alpha', 'color': stroke.colour}
        bars = plot.hbar(y='y', right='share', height=BAR, **look)
        look = {'text_font': value(FONT), 'text_font_size': '12.5px', 'text_color': palette.INK}
        look |= {'source': self._source, 'y': 'above', 'text_baseline': 'middle'}
        plot.text(x=0.0, text='place', **look)
        plot.text(x=1.0, text='size', text_align='right', **look)
        hover(plot, bars, [('', '@tip')])
        return plot


def _said(places: Where) -> str:
    """The joints with most of the error, and what differs with direction."""
    if places.noise_only:
        return NOISE_ONLY
    joints = sorted(places.joints, key=lambda r: -r['share'])[:MOST_JOINTS]
    shares = ', '.join(f'{r["joint"]} {percent(r["share"])}' for r in joints)
    worst = {r['joint'] for r in joints[:1]}
    moving = [against(*found) for found in against_motion(places.rows) if found[0] in worst]
    lines = [shares if len(places.joints) > 1 else '', *moving]
    return '; '.join(line for line in lines if line)


def _rows(state: State, places: Where) -> Rows:
    """A bar for each place."""
    if places.noise_only:
        return NO_ROWS
    shown = ranked(places.rows)[:ROWS]
    bags = numbered(state.scene.recordings)
    words = [in_print(r, bags) for r in shown]
    y = -np.arange(len(shown), dtype=float)
    return {
        'y': [*y],
        'above': [*(y + ABOVE)],
        'share': [float(r['share']) for r in shown],
        'place': [_place(w) for w in words],
        'size': [f'{w["share"]}, {w["torque"]}' for w in words],
        'tip': [_tip(w) for w in words],
        'begin': _begins(state, shown),
        'alpha': [1.0 if stands_out(r) else FAINT for r in shown],
    }


def _place(words: dict[str, Any]) -> str:
    return f'{words["joint"]}, {words["variable"]} {words["range"]}'.strip()


def _tip(words: dict[str, Any]) -> str:
    part = f'{words["share"]} of the error in {words["time"]} of the time'
    size = f'{words["torque"]} (noise {words["noise"]})'
    return f'{_place(words)}: {part}, {size}; worst at {words["windows"]}'


def _begins(state: State, rows: Sequence[dict]) -> list[float]:
    """Where on the timeline the worst window of each place begins [s]."""
    sources = np.array([r['bags'][0] for r in rows], dtype=int)
    times = np.array([r['windows'][0][0] for r in rows])
    return [float(t) for t in state.scene.timeline.at(sources, times)]
