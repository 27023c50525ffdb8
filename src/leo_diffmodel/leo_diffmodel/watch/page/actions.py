# SPDX-License-Identifier: Apache-2.0
"""Find it for me, undo, all off, add to model, take away."""

from __future__ import annotations

import shlex
import shutil

from bokeh.layouts import column, row
from bokeh.models import Button
from markupsafe import Markup

from leo_diffmodel.watch.errand import Finder
from leo_diffmodel.watch.page.look import CARD, said, SIDE, small, wrong
from leo_diffmodel.watch.state import State
from leo_diffmodel.watch.view import FILM_SECONDS
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
        self._said: str = ''
        self._words = said(width=SIDE - 40, name='said')
        self._find.on_click(self._started)
        self._undo.on_click(state.undo)
        self._clear.on_click(state.clear)
        self._add.on_click(self._added)
        files = said(_files(), width=SIDE - 40)
        self._drawn = said(width=SIDE - 40, name='drawing')
        buttons = row(self._find, self._add), row(self._undo, self._clear)
        parts = *buttons, self._words, files, self._drawn
        self.root = column(*parts, stylesheets=[CARD], width=SIDE)
        self.refresh()

    def refresh(self) -> None:
        """Show how far the search is, what it said, and what can be done."""
        self._undo.disabled = not self._state.can_undo
        self._clear.disabled = self._add.disabled = not self._state.setting.on
        self._find.disabled = self._finder.busy
        ms = 1000 * self._state.seconds
        time = small(f'computed in {ms:.0f} ms') if ms else ''
        lines = [self._search(), self._said, self._typed(), time]
        self._words.text = Markup().join(Markup('<div>{}</div>').format(x) for x in lines if x)
        self._drawn.text = self._drawing()

    def _started(self) -> None:
        self._said = ''
        self._finder.start()
        self.refresh()

    def _added(self) -> None:
        try:
            self._said = Markup('wrote <code>{}</code>').format(self._state.add())
        except (UserError, OSError) as error:
            self._said = wrong(error)
        self.refresh()

    def _search(self) -> str:
        """What the search is at, or what it found."""
        news = self._finder.news
        if self._finder.busy:
            return f'explaining, {news.count}: {news.text} …'
        if news.error:
            return wrong(news.error)
        if self._state.answer is None:
            return ''
        data = self._state.answer.data
        return Markup('<b>{verdict}</b>: {sentence}').format(**data)

    def _typed(self) -> str:
        """The command that writes the same model, while it was all done by hand."""
        state = self._state
        if not state.setting.on or (state.answer and state.setting == state.answer.setting):
            return ''
        typed = shlex.join([*self._command, *state.words])
        return Markup('<code>{} -o NEW.yaml</code>').format(typed)

    def _drawing(self) -> str:
        """What is being drawn, or why it is not."""
        drawing = self._state.drawing
        if drawing.news.error:
            return wrong(drawing.news.error)
        return small(f'drawing {drawing.news.text} …') if drawing.busy else ''


def _files() -> Markup:
    """Links to what can be taken away, as HTML."""
    film = f'the robots moving, {FILM_SECONDS:g} s from now'
    mp4 = ['comparison.mp4'] if shutil.which('ffmpeg') else []
    lines = [
        _links('this view', 'view.png', 'view.svg', 'copy.html'),
        _links(film, 'comparison.gif', *mp4),
        _links('the numbers', 'numbers.csv'),
        *([] if mp4 else [small(WITHOUT_FFMPEG)]),
    ]
    return Markup('<br>').join(lines)


def _links(what: str, *names: str) -> Markup:
    link = Markup('<a href="{}" download>{}</a>')
    links = Markup().join(link.format(name, name.rpartition('.')[2].upper()) for name in names)
    return Markup('{}: {}').format(what, links)
