# SPDX-License-Identifier: Apache-2.0
"""The view as a picture or a film."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
import numpy as np
from PIL import Image

from leo_diffmodel.picture import palette
from leo_diffmodel.picture.canvas import TICK
from leo_diffmodel.picture.film import write_gif, write_mp4
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.watch.view import GHOSTS, heights, MODELS, View
from leo_msgs_py.whole_file import whole
from leo_sim.common.worker import Report

PICTURES = ('.png', '.svg')
WIDTH, HEIGHT, LINE = 12.8, 7.2, 0.24  # of the figure, and what a line of words takes [inch]
FINE, FILM = 150, 75  # dots per inch of a picture and of a film
SAID = 20  # frames between two that are reported
LONG = 300.0  # a logarithmic axis over more than this is marked at its decades alone
PLAIN = FuncFormatter(lambda value, _: f'{value:g}')
DASHED = (0, (4, 2.5))
STYLE: dict[str, Any] = {'color': palette.INK, 'fontsize': 11, 'parse_math': False}
MUTED = {**STYLE, 'color': palette.MUTED}


def draw(view: View, path: Path, report: Report) -> str:
    """Write .png, .svg, .gif or .mp4, as the path ends; its name. UserError: no film is made."""
    report(path.name)
    with whole(path) as part:
        if path.suffix in PICTURES:
            Drawn(view, FINE).figure.savefig(part)
        else:
            write = write_gif if path.suffix == '.gif' else write_mp4
            write(part, _frames(view, lambda text: report(f'{path.name}, {text}')))
    return path.name


def _frames(view: View, report: Report) -> Iterator[Image.Image]:
    drawn = Drawn(view, FILM, animated=True)
    canvas = FigureCanvasAgg(drawn.figure)
    canvas.draw()
    still = canvas.copy_from_bbox(drawn.figure.bbox)
    for k in range(len(view.times)):
        drawn.show(k)
        canvas.restore_region(still)
        for artist in drawn.moving:
            drawn.figure.draw_artist(artist)
        if k % SAID == 0:
            report(f'picture {k + 1} of {len(view.times)}')
        yield Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB')


class Drawn:
    """A view on a figure, at the first of its times.

    What `show` changes is `moving`, from below to above. Where `animated`, the figure is drawn
    without it, so that it can be drawn on top.
    """

    def __init__(self, view: View, dpi: int, animated: bool = False) -> None:
        self._view = view
        height = HEIGHT + LINE * len(view.switched)
        even = 2 * round(height * dpi / 2) / dpi  # an even number of dots, as films need [inch]
        self.figure = Figure((WIDTH, even), dpi, facecolor=palette.PAPER)
        head = 1.0 - (0.9 + LINE * len(view.switched)) / height
        edges = {'left': 0.065, 'right': 0.985, 'bottom': 0.6 / height, 'top': head}
        ratios = {'height_ratios': (2.2, 1), 'width_ratios': (1, 1.15)}
        grid = self.figure.add_gridspec(2, 2, **edges, **ratios, hspace=0.28, wspace=0.16)
        self._say(height)
        self._robot = self.figure.add_subplot(grid[0, 0])
        self._draw_robot()
        self._draw_horizon(self.figure.add_subplot(grid[0, 1]))
        self._draw_time(self.figure.add_subplot(grid[1, :]))
        self.moving = [self._ground, *self._ghosts, self._feet, self._cursor, self._clock]
        for artist in self.moving:
            artist.set_animated(animated)
        self.show(0)

    def show(self, k: int) -> None:
        view = self._view
        for lines, q in zip(self._ghosts, view.poses[k], strict=True):
            lines.set_segments(view.stage.lines(q))
        measured = view.poses[k, -1]
        self._feet.set_offsets(view.stage.touched(measured).reshape(-1, 2))
        (left, bottom), (right, top) = view.stage.part(measured)
        self._robot.set(xlim=(left, right), ylim=(bottom, top))
        self._ground.set_data(*_ground(view.stage.stick.ground, left, right))
        self._cursor.set_xdata([view.times[k]] * 2)
        self._clock.set_text(view.places[k])

    def _say(self, height: float) -> None:
        view, words = self._view, {**STYLE, 'va': 'top'}
        top = 1.0 - 0.16 / height
        self.figure.text(0.015, top, view.title, **{**words, 'fontsize': 15}, weight='bold')
        self.figure.text(0.985, top, view.error, **{**words, 'fontsize': 13}, ha='right')
        lines = '\n'.join(view.switched)
        self.figure.text(0.015, top - 0.34 / height, lines, **words, linespacing=1.4)

    def _draw_robot(self) -> None:
        axes, stick = self._robot, self._view.stage.stick
        axes.set_axis_off()
        axes.set_aspect('equal', adjustable='box')
        if stick.root is not None:
            axes.plot(*stick.root[:, None], 's', color=palette.NOISE, markersize=8)
        (self._ground,) = axes.plot([], [], '|-', color=palette.MUTED, lw=1.2, markersize=6)
        self._ghosts = [self._ghost(stroke, *size) for _, stroke, *size in GHOSTS]
        self._feet = axes.scatter([], [], s=55, color=palette.TOUCH, zorder=3)
        self._clock = axes.text(0.0, 0.0, '', transform=axes.transAxes, **MUTED)
        note = f'predicted {self._view.seconds:.2g} s ahead, again and again'
        axes.text(1.0, 0.0, note, transform=axes.transAxes, ha='right', **MUTED)
        given, now, measured = self._ghosts
        named = [('measured', measured), ('as given', given), ('with the switches', now)]
        _legend(axes, named + [('on the ground', self._feet)] * (stick.ground is not None))

    def _ghost(self, stroke: Stroke, width: float, opaque: float) -> LineCollection:
        lines = LineCollection([], **_look(stroke), lw=width, capstyle='round', alpha=opaque)
        self._robot.add_collection(lines)
        return lines

    def _draw_horizon(self, axes: Any) -> None:
        curves, unit = self._view.horizon, self._view.unit
        seconds, (bottom, top) = curves['seconds'], heights(curves)
        axes.set(xscale='log', yscale='log', ylim=(bottom, top))
        axes.set(xlabel='prediction horizon [s]', ylabel=f'rms error of {unit}')
        axes.fill_between(seconds, bottom, curves['floor'], color=palette.NOISE_FILL, lw=0)
        axes.plot(seconds, curves['floor'], color=palette.NOISE, ls=DASHED, label='noise floor')
        for name, stroke, label in MODELS:
            look = {'marker': 'o', 'markersize': 5, 'lw': 2.2, **_look(stroke)}
            axes.plot(seconds, curves[name], label=label, **look)
        for axis, span in ((axes.xaxis, seconds[-1] / seconds[0]), (axes.yaxis, top / bottom)):
            axis.set_major_locator(LogLocator(subs=(1, 2, 5) if span < LONG else (1,)))
            axis.set_major_formatter(PLAIN)
            axis.set_minor_locator(NullLocator())
        _style(axes)
        _legend(axes)

    def _draw_time(self, axes: Any) -> None:
        curves, worst = self._view.time, self._view.worst
        axes.set(xlabel='time, one bag after the other [s]', ylabel=self._view.unit)
        for k, (begin, end) in enumerate(zip(*self._view.held.values(), strict=True)):
            axes.axvspan(begin, end, color=palette.NOISE_FILL, lw=0, label='' if k else 'held out')
        for name, stroke, _ in MODELS:
            axes.step(curves['time'], curves[name], where='mid', lw=1.8, **_look(stroke))
        look = {'color': palette.UNEXPLAINED, 'markeredgecolor': palette.INK, 'markersize': 9}
        axes.plot(worst['time'], worst['error'], 'v', label='worst', **look)
        self._cursor = axes.axvline(self._view.times[0], color=palette.INK, lw=1.2)
        axes.yaxis.set_major_formatter(PLAIN)
        axes.margins(x=0.01, y=0.12)
        axes.set_ylim(bottom=0.0)
        _style(axes)
        _legend(axes)


def _look(stroke: Stroke) -> dict[str, Any]:
    return {'color': stroke.colour, 'ls': DASHED if stroke.dash == 'dashed' else '-'}


def _ground(slope: float | None, left: float, right: float) -> tuple[Any, Any]:
    """The ground with a mark each 0.1 m, for `plot`; nothing where there is none."""
    if slope is None:
        return [], []
    marks = TICK * np.arange(np.ceil(left / TICK), np.floor(right / TICK) + 1)
    return marks, np.tan(slope) * marks


def _style(axes: Any) -> None:
    axes.grid(color=palette.GRID)
    axes.set_axisbelow(True)
    axes.tick_params(colors=palette.MUTED)
    axes.spines[['top', 'right']].set_visible(False)
    axes.spines[['left', 'bottom']].set_color(palette.NOISE)
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set(**STYLE)


def _legend(axes: Any, named: Sequence[tuple[str, Any]] = ()) -> None:
    shown = {'labels': [n for n, _ in named], 'handles': [a for _, a in named]} if named else {}
    place = {'loc': 'lower left', 'bbox_to_anchor': (-0.01, 0.99), 'ncols': 4, 'frameon': False}
    look = {'handlelength': 2.2, 'columnspacing': 1.3, 'handletextpad': 0.6}
    axes.legend(**shown, **place, **look, labelcolor=palette.INK)
