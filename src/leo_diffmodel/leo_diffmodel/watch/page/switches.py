# SPDX-License-Identifier: Apache-2.0
"""The side of the page: the catalogue of effects as switches, and buttons."""

import shlex
import shutil

from bokeh.layouts import column, row
from bokeh.models import CustomJSTickFormatter, NumericInput, Select, Slider, Switch
from markupsafe import Markup

from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.report.page import template
from leo_diffmodel.watch.handle import Handle
from leo_diffmodel.watch.page import look
from leo_diffmodel.watch.page.look import button, following, said, small, WIDE, wrong
from leo_diffmodel.watch.state import State
from leo_diffmodel.watch.view import FILM_SECONDS
from leo_diffmodel.watch.worker import Finder
from leo_msgs_py.errors import UserError
from leo_sim.effects import Parameter

STEP = 0.001
EVERYWHERE = 'every place'
AT_ONCE = 40  # lines that are put on the page together: a browser takes long for those of a walker
NOTE = (
    'A switch begins at the value of a scan of the data not held out; “Find it for me” fits it, '
    'with a 95 % interval. Behind it: the held-out error without it → with it, in noise floors.'
)


class ActionsView:
    def __init__(self, state: State, finder: Finder, command: list[str]) -> None:
        self._state, self._finder, self._command = state, finder, command
        find = 'Find it for me', 'find', self._start, self.refresh
        self._find = button(*find, button_type='primary')
        self._undo = button('Undo', 'undo', state.undo)
        self._clear = button('All off', 'clear', state.clear)
        self._add = button('Add to model', 'add', self._write, self.refresh)
        self._said: str = ''
        self._words = said(name='said', **WIDE)
        self._drawn = said(name='drawing', **WIDE)
        buttons = row(self._find, self._add), row(self._undo, self._clear)
        self.root = look.card(*buttons, self._words, said(_files(), **WIDE), self._drawn)
        self.refresh()

    def refresh(self) -> None:
        self._undo.disabled = not self._state.can_undo
        self._clear.disabled = self._add.disabled = not self._state.setting.on
        self._find.disabled = self._finder.busy
        ms = 1000 * self._state.seconds
        time = small(f'computed in {ms:.0f} ms') if ms else ''
        lines = [self._search(), self._said, self._typed(), time]
        self._words.text = Markup().join(Markup('<div>{}</div>').format(x) for x in lines if x)
        self._drawn.text = self._drawing()

    def _start(self) -> None:
        self._said = ''
        self._finder.start()

    def _write(self) -> None:
        try:
            self._said = Markup('wrote <code>{}</code>').format(self._state.add())
        except (UserError, OSError) as error:
            self._said = wrong(error)

    def _search(self) -> str:
        news = self._finder.news
        if self._finder.busy:
            return f'explaining, {news.count}: {news.text} …'
        if news.error:
            return wrong(news.error)
        if self._state.answer is None:
            return ''
        return Markup('<b>{verdict}</b>: {sentence}').format(**self._state.answer.data)

    def _typed(self) -> str:
        state = self._state
        if not state.setting.on or (state.answer and state.setting == state.answer.setting):
            return ''
        typed = shlex.join([*self._command, *state.words])
        return Markup('<code>{} -o NEW.yaml</code>').format(typed)

    def _drawing(self) -> str:
        drawing = self._state.drawing
        if drawing.news.error:
            return wrong(drawing.news.error)
        return small(f'drawing {drawing.news.text} …') if drawing.busy else ''


def _files() -> Markup:
    ffmpeg = shutil.which('ffmpeg')
    return Markup(template('files.html').render(seconds=FILM_SECONDS, ffmpeg=ffmpeg))


class CatalogueView:
    """A line for each effect at each place; most of a long catalogue come after the first."""

    def __init__(self, state: State) -> None:
        self._state, self._left = state, [*state.scene.candidates.values()]
        self._lines: list[_Line] = []
        places = list(dict.fromkeys(c.where for c in self._left))
        title = {'name': 'place', 'title': 'effects at', **WIDE}
        self._place = Select(options=[EVERYWHERE, *places], value=EVERYWHERE, **title)
        following(self._place, lambda _: self.refresh())
        self.root = look.card(self._place, look.note(NOTE), stylesheets=[look.SCROLLED])
        self.lengthen()

    def lengthen(self) -> bool:
        new = [_Line(self._state, c) for c in self._left[:AT_ONCE]]
        self._left = self._left[AT_ONCE:]
        for line in new:
            line.refresh(self._place.value)
        self._lines += new
        self.root.children = [*self.root.children, *(line.root for line in new)]
        return bool(self._left)

    def refresh(self) -> None:
        for line in self._lines:
            line.refresh(self._place.value)


class _Line:
    def __init__(self, state: State, candidate: Candidate) -> None:
        self._state, self._candidate = state, candidate
        self._label = label = candidate.label
        self._switch = Switch(active=False, width=36, name=f'switch {label}')
        following(self._switch, lambda on: state.switch(label, on), 'active')
        self._words = said(name=f'effect {self._label}', **WIDE)
        self._sliders: list[_Slider] = []
        self._shown: tuple[bool, bool] | None = None
        self.root = column(row(self._switch, self._words, **WIDE), **WIDE)

    def refresh(self, place: str) -> None:
        on = self._label in self._state.setting.on
        shown = on, on or place in (EVERYWHERE, self._candidate.where)
        if not on and shown == self._shown:
            return
        self._shown = self._switch.active, self.root.visible = shown
        self._words.text = self._text()
        if on and not self._sliders:
            self._sliders = [
                _Slider(self._state, self._label, p) for p in self._candidate.parameters
            ]
            self.root.children = [*self.root.children, *(s.root for s in self._sliders)]
        for slider in self._sliders:
            slider.refresh(on)

    def _text(self) -> Markup:
        effect, label = self._candidate.effect, self._label
        about = effect.equation, effect.looks_like or effect.equation
        shown = Markup('<b>{}</b> <small>{}</small><br><small title="{}">{}</small>').format(
            effect.name, self._candidate.where, *about
        )
        if label in self._state.setting.on:
            shown += Markup('<br>{}').format(', '.join(self._state.in_print(label)))
        if (without := self._state.without.get(label)) is None:
            return shown
        sizes = f'{without:.2f}', f'{self._state.sizes[1]:.2f}'
        return shown + Markup('<br>{} → <b>{}</b> noise floors').format(*sizes)


class _Slider:
    """A parameter: a slider over its plausible range, and its value as a number.

    Of a robot on the ground, whose windows take a second, a drag counts where it ends.
    """

    def __init__(self, state: State, label: str, parameter: Parameter) -> None:
        self._state, self._label, self._name = state, label, parameter.name
        self._handle, self._silent = Handle.of(parameter), look.Silence()
        (low, high), name = self._handle.ends, f'{label} {parameter.name}'
        bare = {'show_value': False, 'tooltips': False, 'margin': (26, 8, 0, 8)}
        ends = {'start': low, 'end': high, 'step': STEP, **WIDE}
        self._slider = Slider(value=0, name=f'slider {name}', **ends, **bare)
        digits = CustomJSTickFormatter(code='return `${Number(tick.toPrecision(4))}`')
        unit = f' [{parameter.unit}]' if parameter.unit else ''
        title = {'title': f'{parameter.name}{unit}', 'width': 100, 'name': f'value {name}'}
        anchor = self._handle.anchor
        self._number = NumericInput(mode='float', value=anchor, format=digits, **title)
        dragged = 'value_throttled' if state.scene.model.robot.contacts else 'value'
        following(self._slider, lambda at: self._move(self._handle.value(at)), dragged)
        following(self._number, self._type)
        self.root = row(self._slider, self._number, margin=(0, 0, 8, 40), **WIDE)

    def refresh(self, on: bool) -> None:
        self.root.visible = on
        if not on:
            return
        value = self._state.setting.on[self._label][self._name]
        with self._silent:
            if self._handle.value(self._slider.value) != value:
                self._slider.value = round(self._handle.position(value), 6)
            self._number.value = value

    def _type(self, value: float | None) -> None:
        if value is not None:
            self._move(self._handle.exact(value))

    def _move(self, value: float) -> None:
        if not self._silent.on and self._label in self._state.setting.on:
            self._state.move(self._label, self._name, value)
