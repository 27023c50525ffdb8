# SPDX-License-Identifier: Apache-2.0
"""What can be taken away from the page: made when it is asked for, sent, and left nowhere."""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import suppress
import csv
from functools import partial
import io
import mimetypes
from pathlib import Path
import re
from tempfile import TemporaryDirectory
from typing import Any

from numpy import ndarray
from tornado.iostream import StreamClosedError
from tornado.web import RequestHandler

from leo_diffmodel.report.page import render, Section
from leo_diffmodel.report.text import source
from leo_diffmodel.watch import view
from leo_diffmodel.watch.page.errors import FLOOR, HorizonView, OverTimeView, words
from leo_diffmodel.watch.page.look import ROBOTS
from leo_diffmodel.watch.page.robot import RobotView
from leo_diffmodel.watch.state import State
from leo_sim.common.worker import News

Times = Callable[[State], ndarray]
Route = tuple[str, type[RequestHandler], dict[str, Any]]
POLL = 0.2  # between two looks at how far a drawing is [s]
CHUNK = 1 << 16  # bytes that are sent at once
HEAD = ('what', 'of', 'at', 'at_unit', 'as_given', 'now', 'noise_floor', 'unit')
"""Of the numbers as CSV: one line a figure, each with its unit."""


def routes(state: State) -> list[Route]:
    texts = {'numbers.csv': numbers, 'copy.html': copy}
    drawn = {'view.png': view.now, 'view.svg': view.now}
    drawn |= {'comparison.gif': view.from_now, 'comparison.mp4': view.from_now}
    options: dict[str, Any] = {'state': state, 'one_by_one': asyncio.Lock()}
    pictures = [(name, _Drawing, {**options, 'times': times}) for name, times in drawn.items()]
    words = [(name, _Text, {'state': state, 'content': make}) for name, make in texts.items()]
    return [(re.escape(f'/{name}'), kind, given) for name, kind, given in [*words, *pictures]]


class _File(RequestHandler):
    @property
    def name(self) -> str:
        return self.request.path.rpartition('/')[2]

    def say_kind(self, kind: str | None = None) -> None:
        kind = kind or mimetypes.guess_type(self.name)[0] or ''
        charset = '; charset=utf-8' if kind.startswith('text/') else ''
        self.set_header('Content-Type', f'{kind}{charset}')
        self.set_header('Cache-Control', 'no-store')


class _Text(_File):
    def initialize(self, state: State, content: Callable[[State], str]) -> None:
        self._state, self._content = state, content

    def get(self) -> None:
        self.say_kind()
        self.finish(self._content(self._state))


class _Drawing(_File):
    """A picture or a film, drawn by another process; one after the other, named on the page."""

    def initialize(self, times: Times, state: State, one_by_one: asyncio.Lock) -> None:
        self._times, self._state = times, state
        self._one_by_one, self._gone = one_by_one, False

    async def get(self) -> None:
        with TemporaryDirectory(prefix='leo_watch_') as folder:
            path = Path(folder, self.name)
            async with self._one_by_one:
                news = await self._drawn(path)
            await self._send(path, news)

    def on_connection_close(self) -> None:
        self._gone = True

    async def _send(self, path: Path, news: News) -> None:
        """Send what was drawn, or why it was not; nothing where nobody waits for it."""
        if news.error:
            self.set_status(500)
            self.say_kind('text/plain')
            self.finish(f'{news.error}\n')
        elif news.answer:
            self.say_kind()
            self.set_header('Content-Length', str(path.stat().st_size))
            with path.open('rb') as file, suppress(StreamClosedError):
                while chunk := file.read(CHUNK):
                    self.write(chunk)
                    await self.flush()

    async def _drawn(self, path: Path) -> News:
        """Have it drawn; no answer where nobody waits for it."""
        from leo_diffmodel.watch.drawing import draw  # matplotlib, which the page has no need of

        state, drawing = self._state, self._state.drawing
        if self._gone:
            return News()
        drawing.begin(partial(draw, view.view_of(state, self._times(state)), path))
        state.notify()
        while drawing.busy and not self._gone:
            await asyncio.sleep(POLL)
            if drawing.poll():
                state.notify()
        drawing.stop()
        state.notify()
        return drawing.news


def numbers(state: State) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator='\n')
    writer.writerow(HEAD)
    writer.writerows([*_values(state), *_horizon(state), *_time(state)])
    return out.getvalue()


def _values(state: State) -> Iterator[tuple]:
    for label, values in state.switched.items():
        for p, value in values:
            yield 'value', f'{label} {p.name}', '', '', p.neutral, value, '', p.unit


def _horizon(state: State) -> Iterator[tuple]:
    rows = zip(state.given.rows, state.now.rows, state.floor.rows, strict=True)
    for before, after, floor in rows:
        for i, s in enumerate(state.states):
            figures = before['rmse'][i], after['rmse'][i], floor['noise_floor'][i]
            at = before['seconds'], 's ahead'
            yield 'held-out rms error', s['name'], *at, *figures, s['unit']


def _time(state: State) -> Iterator[tuple]:
    film, what = state.film, f'rms error over {state.horizon:g} s'
    for i, s in enumerate(state.states):
        both = film.error(film.given, i), film.error(film.repaired, i)
        for time, *errors in zip(film.middle, *both, strict=True):
            yield what, s['name'], time, 's on the timeline', *errors, '', s['unit']


def copy(state: State) -> str:
    """What the page shows now, as one HTML file that needs neither server nor network."""
    state.finish()
    parts = RobotView(state), HorizonView(state), OverTimeView(state)
    values = {
        'words': words(state),
        'at': state.scene.timeline.words(state.player.now),
        'ahead': state.horizon,
        'rows': {label: state.in_print(label) for label in state.setting.on},
        'without': state.without,
        'size': state.sizes[1],
        'legend': [*ROBOTS, FLOOR],
    }
    section = Section('watch.html', values, tuple(part.plot for part in parts))
    title = f'{state.scene.given.robot.name}: the model beside the robot'
    return render(title, source(state.scene.recordings), [section])
