# SPDX-License-Identifier: Apache-2.0
"""The robot as a stick figure, with the model as given and as switched as ghosts."""

from typing import Any

from bokeh.models import ColumnDataSource, CustomJSTickFormatter, Range1d, Select, Slider, Span
from bokeh.plotting import figure
from markupsafe import Markup
import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.watch.film import SPEEDS
from leo_diffmodel.watch.page import look
from leo_diffmodel.watch.page.look import following, legend, ROBOTS, said, WIDE
from leo_diffmodel.watch.state import LONGEST, SHORTEST, State
from leo_diffmodel.watch.view import ASPECT, GHOSTS, Stage


class RobotView:
    def __init__(self, state: State) -> None:
        self._state = state
        self._stage = Stage(state.scene.model.robot, state.scene.recordings)
        self.plot = self._plot()
        self._sources = self._ghosts()
        self._clock = said(width=230, name='clock')
        self._play = look.button('Play', 'play', state.play_or_pause, width=80)
        speeds = [f'{s:g}' for s in SPEEDS]
        speed = Select(options=speeds, value='1', width=80, title='speed', name='speed')
        self._speed = following(speed, lambda v: state.at_speed(float(v)))
        length = state.player.length
        time = {'title': 'time', 'show_value': False, 'start': 0, 'end': length}
        scrub = Slider(value=0, name='scrub', step=length / 2000, **time, **WIDE)
        self._scrub = following(scrub, self._scrubbed)
        episodes = [e for r in state.scene.recordings for e in r.episodes]
        longest = min(LONGEST, 0.5 * max(float(e.t[-1] - e.t[0]) for e in episodes))
        ends = {'start': np.log10(SHORTEST), 'end': np.log10(longest), 'step': 0.01}
        digits = CustomJSTickFormatter(code='return (10**tick).toPrecision(2)')
        ahead = {'title': 'predict ahead over [s]', 'format': digits, 'name': 'horizon'}
        horizon = Slider(value=np.log10(state.horizon), **ends, **ahead, **WIDE)
        self._horizon = following(horizon, lambda v: state.look_ahead(round(10**v, 4)))
        controls = look.wrapped((self._play, 80), (speed, 80), (scrub, 140))
        self.root = look.card(
            said(legend(*ROBOTS)), self.plot, self._clock, controls, self._horizon
        )
        self.refresh()

    def refresh(self) -> None:
        player = self._state.player
        self._play.label = 'Pause' if player.playing else 'Play'
        self._speed.value = f'{player.speed:g}'
        self._horizon.value = round(float(np.log10(self._state.horizon)), 9)
        self.tick()

    def tick(self) -> None:
        now = self._state.player.now
        self._scrub.value = now
        words = self._state.scene.timeline.words(now)
        self._clock.text = Markup('<span class="muted">{}</span>').format(words)
        frame = self._state.film.frame(now)
        for source, q in zip(self._sources, frame, strict=True):
            lines = self._stage.lines(q)
            source.data = {
                'xs': [p[:, 0].tolist() for p in lines],
                'ys': [p[:, 1].tolist() for p in lines],
            }
        x, y = self._stage.touched(frame.measured).T.tolist()
        self._feet.data = {'x': x, 'y': y}
        if self._stage.stick.root is None:
            self._look_at(frame.measured)

    def _plot(self) -> Any:
        stick = self._stage.stick
        self._x, self._y = Range1d(), Range1d()
        self._look_at(self._state.film.frame(0.0).measured)
        bare = {'tools': '', 'toolbar_location': None, 'min_border': 0, 'outline_line_color': None}
        size = {'aspect_ratio': ASPECT, 'sizing_mode': 'scale_width'}
        plot = figure(x_range=self._x, y_range=self._y, name='robot', **size, **bare)
        plot.axis.visible, plot.grid.grid_line_color = False, None
        if stick.ground is not None:
            plot.add_layout(Span(location=0, dimension='width', line_color=palette.MUTED))
        elif stick.root is not None:
            plot.scatter(*stick.root[:, None], size=13, marker='square', color=palette.NOISE)
        return plot

    def _ghosts(self) -> list[ColumnDataSource]:
        sources = []
        for name, stroke, width, alpha in GHOSTS:
            sources.append(ColumnDataSource({'xs': [], 'ys': []}, name=f'robot {name}'))
            line = {'line_color': stroke.colour, 'line_dash': stroke.dash, 'line_cap': 'round'}
            size = {'line_width': width, 'line_alpha': alpha}
            self.plot.multi_line('xs', 'ys', source=sources[-1], **line, **size)
        self._feet = ColumnDataSource({'x': [], 'y': []}, name='feet')
        self.plot.scatter('x', 'y', source=self._feet, size=9, color=palette.TOUCH)
        return sources

    def _scrubbed(self, seconds: float) -> None:
        if abs(seconds - self._state.player.now) > 1.5 * self._scrub.step:
            self._state.go(seconds)

    def _look_at(self, q: np.ndarray) -> None:
        (left, bottom), (right, top) = self._stage.part(q)
        self._x.update(start=left, end=right)
        self._y.update(start=bottom, end=top)
