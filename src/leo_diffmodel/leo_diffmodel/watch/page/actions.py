# SPDX-License-Identifier: Apache-2.0
"""Find it for me, undo, all off, add to model, take away."""

from __future__ import annotations

from html import escape
import shlex
import shutil

from bokeh.layouts import column, row
from bokeh.models import Button, Div

from leo_diffmodel.watch import shown
from leo_diffmodel.watch.finder import Finder
from leo_diffmodel.watch.page.look import CARD, SIDE, TEXT
from leo_diffmodel.watch.state import State
from leo_msgs_py.errors import UserError

WITHOUT_FFMPEG = 'for MP4 install the program ffmpeg, and start leo watch again'


class ActionsView:
    """Buttons, and what came of them in words."""

    def __init__(self, state: State, finder: Finder, command: list[str]) -> None:
        """Args: the state, the search, and `leo add MODEL` as it would be typed."""
        self._state, self._finder, self._command = state, finder, command
        self._find = Button(label='Find it for me', button_type='primary', name='find')
        self._undo = Button(label='Undo', name='undo')
        self._clear = Button(label='All off', name='clear')
        self._add = Button(label='Add to model', name='add')
        self._said = ''
        self._words = Div(text='', stylesheets=[TEXT], width=SIDE - 40, name='said')
        self._connect()
        files = Div(text=_files(), stylesheets=[TEXT], width=SIDE - 40)
        self._drawn = Div(text='', stylesheets=[TEXT], width=SIDE - 40, name='drawing')
        self.root = column(row(self._find, self._add), row(self._undo, self._clear), self._words,
                           files, self._drawn, stylesheets=[CARD], width=SIDE)  # fmt: skip
        self.refresh()

    def refresh(self) -> None:
        """Show how far the search is, what it said, and what can be done."""
        self._undo.disabled = not self._state.can_undo
        self._clear.disabled = self._add.disabled = not self._state.setting.on
        self._find.disabled = self._finder.busy
        lines = [self._search(), self._said, self._typed(), self._time()]
        self._words.text = ''.join(f'<div>{line}</div>' for line in lines if line)
        self._drawn.text = self._drawing()

    def _connect(self) -> None:
        self._find.on_click(self._started)
        self._undo.on_click(self._state.undo)
        self._clear.on_click(self._state.clear)
        self._add.on_click(self._added)

    def _started(self) -> None:
        self._said = ''
        self._finder.start()
        self.refresh()

    def _added(self) -> None:
        try:
            self._said = f'wrote <code>{escape(str(self._state.add()))}</code>'
        except (UserError, OSError) as error:
            self._said = f'<span class="error">{escape(str(error))}</span>'
        self.refresh()

    def _search(self) -> str:
        """What the search is at, or what it found."""
        news = self._finder.news
        if self._finder.busy:
            return f'explaining, {news.count}: {escape(news.text)} …'
        if news.error:
            return f'<span class="error">{escape(news.error)}</span>'
        if self._state.answer is None:
            return ''
        data = self._state.answer.data
        return f'<b>{escape(data["verdict"])}</b>: {escape(data["sentence"])}'

    def _typed(self) -> str:
        """The command that writes the same model, while it was all done by hand."""
        state = self._state
        if not state.setting.on or (state.answer and state.setting == state.answer.setting):
            return ''
        return f'<code>{escape(shlex.join([*self._command, *state.words]))} -o NEW.yaml</code>'

    def _drawing(self) -> str:
        """What is being drawn, or why it is not."""
        drawing = self._state.drawing
        if drawing.news.error:
            return f'<span class="error">{escape(drawing.news.error)}</span>'
        return f'<small>drawing {escape(drawing.news.text)} …</small>' if drawing.busy else ''

    def _time(self) -> str:
        ms = 1000 * self._state.seconds
        return f'<small>computed in {ms:.0f} ms</small>' if ms else ''


def _files() -> str:
    """Links to what can be taken away, as HTML."""
    film = f'the robots moving, {shown.FILM_SECONDS:g} s from now'
    mp4 = _link('comparison.mp4') if shutil.which('ffmpeg') else ''
    lines = [f'this view: {_link("view.png")}{_link("view.svg")}{_link("copy.html")}',
             f'{film}: {_link("comparison.gif")}{mp4}', f'the numbers: {_link("numbers.csv")}',
             '' if mp4 else f'<small>{WITHOUT_FFMPEG}</small>']  # fmt: skip
    return '<br>'.join(line for line in lines if line)


def _link(name: str) -> str:
    kind = name.rpartition('.')[2].upper()
    return f'<a href="{name}" download>{kind}</a>'
