# SPDX-License-Identifier: Apache-2.0
"""The torque that models lack: where each of them fails, and one joint's against a variable."""

from typing import Any

from bokeh.core.properties import value
from bokeh.events import Tap
from bokeh.layouts import column
from bokeh.models import ColumnDataSource, NumeralTickFormatter, Range1d, Select
from markupsafe import Markup
import numpy as np

from leo_diffmodel.compare.sizes import torque_unit
from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.compare.where import against_motion, ranked, stands_out, Where
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report import binned
from leo_diffmodel.report.canvas import canvas, FONT, hover
from leo_diffmodel.report.sections.where import against, in_print
from leo_diffmodel.report.text import numbered, percent
from leo_diffmodel.watch.missing import Missing
from leo_diffmodel.watch.page import look
from leo_diffmodel.watch.page.look import following, legend, ROBOTS, said, small, WIDE
from leo_diffmodel.watch.state import State

ROWS, MOST_JOINTS = 6, 3
HEIGHT = 268
BAR = 0.3
ABOVE = 0.38  # how far above the middle of its bar a place is named, in rows
FAINT = 0.35  # opacity of what may be chance
NOTE = (
    'The torque that a model lacks, by joint and condition: the share that a place has of its '
    'mean square beyond noise, and its rms there. Pale: no more than chance makes of its time. '
    'A tap goes to the worst window.'
)
TIP = (
    '{}: {share} of the error in {time} of the time, {torque} (noise {noise}); worst at {windows}'
)
NOISE_ONLY = 'nowhere: the torque it lacks stays within its noise'
Rows = dict[str, list]
NO_ROWS: Rows = {
    name: [] for name in ('y', 'above', 'share', 'place', 'size', 'tip', 'begin', 'alpha')
}
MISSING_NOTE = (
    'Grey: the constant torque that would explain each short window with the model as given; '
    'black: mean of a bin ± its standard error. Blue: what the same estimate would show if what '
    'is switched on were all that is missing.'
)
HEAD = Markup('<b>Torque the model lacks</b> ')
NO_MEANS: dict[str, Any] = {name: [] for name in ('x', 'y', 'low', 'high', 'curve0')}


class WhereView:
    def __init__(self, state: State) -> None:
        self._state = state
        models = zip(('given', 'now'), ROBOTS[1:], strict=True)
        self._rankings = [_Ranking(state, *model) for model in models]
        self._words = said(name='where says', **WIDE)
        rankings = ((r.root, look.MAIN) for r in self._rankings)
        both = look.wrapped(*rankings, spacing=3 * look.GAP)
        self.root = look.card(self._words, both)
        self.refresh()

    def refresh(self) -> None:
        both = self._state.missing
        note = both.trouble or ('computing …' if both.behind else NOTE)
        self._words.text = Markup('<b>Where it fails</b> {}').format(small(note))
        for ranking, missing in zip(self._rankings, (both.given, both.now), strict=True):
            ranking.show(missing)


class _Ranking:
    def __init__(self, state: State, which: str, model: tuple[str, Stroke]) -> None:
        self._state, self._head = state, legend(model)
        self._shown: Missing | None = None
        self._source = ColumnDataSource(NO_ROWS, name=f'where {which}')
        self._words = said(self._head, name=f'where {which} says', **WIDE)
        self.plot = self._plot(model[1], which)
        self.plot.on_event(Tap, self._go)
        self.root = column(self._words, self.plot, **WIDE)

    def show(self, missing: Missing | None) -> None:
        if missing is None or missing is self._shown:
            return
        self._shown = missing
        rows = _rows(self._state, missing.places)
        self._source.data, self.plot.visible = rows, bool(rows['y'])
        self._words.text = self._head + Markup('<br>') + small(_said(missing.places))

    def _go(self, tap: Tap) -> None:
        begin, number = self._source.data['begin'], round(-tap.y)
        if 0 <= number < len(begin):
            self._state.go(begin[number])

    def _plot(self, stroke: Stroke, which: str) -> Any:
        ranges = {'x_range': Range1d(0.0, 1.0), 'y_range': Range1d(-ROWS + 0.5, 0.6)}
        name = f'where {which} plot'
        plot = canvas('share of the error', '', height=HEIGHT, name=name, **ranges)
        plot.yaxis.visible, plot.ygrid.grid_line_color = False, None
        plot.xaxis.formatter = NumeralTickFormatter(format='0 %')
        colour = {'alpha': 'alpha', 'color': stroke.colour}
        bars = plot.hbar(y='y', right='share', height=BAR, source=self._source, **colour)
        font = {'text_font': value(FONT), 'text_font_size': '12.5px', 'text_color': palette.INK}
        words = {'source': self._source, 'y': 'above', 'text_baseline': 'middle', **font}
        plot.text(x=0.0, text='place', **words)
        plot.text(x=1.0, text='size', text_align='right', **words)
        hover(plot, bars, [('', '@tip')])
        return plot


def _said(places: Where) -> str:
    if places.noise_only:
        return NOISE_ONLY
    joints = sorted(places.joints, key=lambda r: -r['share'])[:MOST_JOINTS]
    shares = ', '.join(f'{r["joint"]} {percent(r["share"])}' for r in joints)
    worst = {r['joint'] for r in joints[:1]}
    moving = [against(*found) for found in against_motion(places.rows) if found[0] in worst]
    lines = [shares if len(places.joints) > 1 else '', *moving]
    return '; '.join(line for line in lines if line)


def _rows(state: State, places: Where) -> Rows:
    shown = [] if places.noise_only else ranked(places.rows)[:ROWS]
    bags = numbered(state.scene.recordings)
    words = [in_print(r, bags) for r in shown]
    y = -np.arange(len(shown), dtype=float)
    sources = np.array([r['bags'][0] for r in shown], dtype=int)
    times = np.array([r['windows'][0][0] for r in shown])
    return {
        'y': [*y],
        'above': [*(y + ABOVE)],
        'share': [float(r['share']) for r in shown],
        'place': [_place(w) for w in words],
        'size': [f'{w["share"]}, {w["torque"]}' for w in words],
        'tip': [TIP.format(_place(w), **w) for w in words],
        'begin': state.scene.timeline.at(sources, times).tolist(),
        'alpha': [1.0 if stands_out(r) else FAINT for r in shown],
    }


def _place(words: dict[str, Any]) -> str:
    return f'{words["joint"]}, {words["variable"]} {words["range"]}'.strip()


class MissingView:
    def __init__(self, state: State) -> None:
        self._state, self._silent = state, look.Silence()
        self._shown: tuple[object, ...] = ()
        self._dots = ColumnDataSource({'x': [], 'y': []}, name='missing torque')
        self._means = ColumnDataSource(NO_MEANS, name='binned torque')
        joint = Select(title='joint', width=160, name='joint')
        variable = Select(title='against', width=260, name='against')
        self._joint = following(joint, lambda v: self._show_joint(int(v)))
        self._variable = following(variable, lambda v: self._show_variable(int(v)))
        sources = self._dots, self._means
        self.plot, means = binned.torque_canvas(*sources, [palette.REPAIRED], name='missing plot')
        hover(self.plot, means, [('mean', '@y{0.000}'), ('at', '@x{0.000}')])
        self._words = said(**WIDE, name='missing says')
        head = look.wrapped((joint, 160), (variable, 260), (self._words, look.WORDS))
        self.root = look.card(head, self.plot)
        self.refresh()

    def refresh(self) -> None:
        both = self._state.missing
        self._words.text = HEAD + small(both.trouble or MISSING_NOTE)
        if both.given is None:
            return
        missing = both.given.torque
        self._choose(missing)
        shown = missing, both.curve, self._state.chosen
        if [*map(id, shown)] != [*map(id, self._shown)]:
            self._shown = shown
            self._draw(missing, both.curve)

    def _choose(self, missing: MissingTorque) -> None:
        chosen = self._state.chosen
        if chosen is None or chosen[0] not in _joints(missing):
            self._state.chosen = self._matters(missing, binned.lacking(missing)[0])

    def _matters(self, missing: MissingTorque, joint: int) -> tuple[int, int]:
        return joint, binned.that_matters(missing, self._state.scene.model.robot, joint)

    def _draw(self, missing: MissingTorque, curve: np.ndarray | None) -> None:
        robot, (joint, number) = self._state.scene.model.robot, self._state.chosen or (0, 0)
        axes, names = binned.variables(missing, robot, joint), robot.joint_names
        number = min(number, len(axes) - 1)
        joints = [(str(j), names[j]) for j in _joints(missing)]
        labels = [(str(i), label) for i, (label, _) in enumerate(axes)]
        with self._silent:
            self._joint.update(options=joints, value=str(joint))
            self._variable.update(options=labels, value=str(number))
        seen, (label, values) = missing.seen[:, joint], axes[number]
        heights = np.full(int(seen.sum()), np.nan) if curve is None else curve[seen, joint]
        unit = torque_unit(robot, names[joint])
        drawn = binned.Binned.of(values[seen], missing.torque[seen, joint], [heights], unit)
        self._dots.data, self._means.data = dict(drawn.dots), dict(drawn.means)
        drawn.label(self.plot, label)

    def _show_joint(self, joint: int) -> None:
        if not self._silent.on and (given := self._state.missing.given):
            self._state.choose(*self._matters(given.torque, joint))

    def _show_variable(self, number: int) -> None:
        if not self._silent.on and (chosen := self._state.chosen):
            self._state.choose(chosen[0], number)


def _joints(missing: MissingTorque) -> list[int]:
    count = missing.seen.sum(axis=0)
    return [j for j, n in enumerate(count) if n >= binned.FEWEST] or binned.lacking(missing)[:1]
