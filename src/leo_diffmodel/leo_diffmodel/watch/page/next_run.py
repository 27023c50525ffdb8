# SPDX-License-Identifier: Apache-2.0
"""What to record next: the run as a curve, which effects it separates, and where it is."""

from itertools import cycle, islice
from typing import Any

from bokeh.layouts import column, row
from bokeh.models import ColumnDataSource
from markupsafe import Markup
import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.next_run.run_file import input_units
from leo_diffmodel.next_run.settings import NEXT
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas
from leo_diffmodel.watch.next_run import NextRun, Plan
from leo_diffmodel.watch.page import look
from leo_diffmodel.watch.page.look import legend, said, small, WIDE, wrong
from leo_msgs_py.terminal import leo
from leo_sim.description.robot import Robot

HEIGHT = 170
COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9')
NO_LINES: dict[str, list] = {'ts': [], 'us': [], 'colour': [], 'joint': []}
ON_ROBOT = 'on the robot, recorded'
NOTE = (
    'Motion as the model with what was named predicts it, of a scripted motion the first '
    f'{NEXT.tried_seconds:g} s. Gaps: the motors are off, or the robot is put up again.'
)


class NextRunView:
    def __init__(self, next_run: NextRun) -> None:
        self._next = next_run
        words = 'What to record next', 'next run'
        self._ask = look.button(*words, next_run.start, self.refresh, width=200)
        self._words = said(name='next run says', **WIDE)
        self._inputs = ColumnDataSource(NO_LINES, name='next run inputs')
        self._motion = ColumnDataSource(NO_LINES, name='next run motion')
        self._shown: Plan | None = None
        self._upper = lines_canvas('', '', 'next run plot', self._inputs)
        self._lower = lines_canvas('time [s]', '', None, self._motion, x_range=self._upper.x_range)
        self._legend = said()
        plots = self._upper, self._lower
        self._curves = column(*plots, self._legend, said(small(NOTE)), **WIDE)
        self.root = look.card(row(self._ask), self._words, self._curves)
        self.refresh()

    def refresh(self) -> None:
        plan = self._next.plan
        self._ask.disabled = self._next.busy or bool(self._next.hindrance)
        self._words.text = Markup().join(map(Markup('<div>{}</div>').format, self._lines()))
        self._curves.visible = plan is not None and plan.predicted is not None
        if plan and plan.predicted and plan is not self._shown:
            self._shown = plan
            self._draw(plan.robot, plan.predicted)

    def _lines(self) -> list[str]:
        news, plan = self._next.news, self._next.plan
        if self._next.busy:
            return [f'choosing a run, {news.count}: {news.text} …']
        if plan is not None:
            return [*plan.words, *self._files()]
        if hindrance := self._next.hindrance:
            return [small(hindrance)]
        return [wrong(news.error)] if news.error else []

    def _files(self) -> list[str]:
        file = self._next.file
        lines: list[str] = [Markup('wrote <code>{}</code>').format(file)] if file else []
        if self._next.said:
            lines.append(wrong(self._next.said))
        if self._next.words:
            lines.append(Markup('{}: <code>{}</code>').format(ON_ROBOT, leo(*self._next.recorded)))
        return lines

    def _draw(self, robot: Robot, track: Recording) -> None:
        driven = [track.joints.index(a) for a in track.actuators]
        left_out = {*track.actuators, *robot.base_joints}
        shown = driven + [k for k, name in enumerate(track.joints) if name not in left_out]
        names = tuple(track.joints[k] for k in shown)
        t, x, inputs = joined(track)
        self._inputs.data = stepped(t, inputs, track.actuators)
        self._motion.data = _lines([t] * len(names), [*x[:, shown].T], names)
        self._upper.yaxis.axis_label = f'input [{input_units(robot)}]'
        lengths = dict.fromkeys(length_unit(robot, name) for name in names)
        self._lower.yaxis.axis_label = f'position [{" or ".join(lengths)}]'
        self._legend.text = joints_legend(names)


def lines_canvas(
    x_label: str, y_label: str, name: str | None, source: ColumnDataSource, **options: Any
) -> Any:
    plot = canvas(x_label, y_label, height=HEIGHT, name=name, **options)
    plot.multi_line('ts', 'us', source=source, line_color='colour', line_width=1.5)
    return plot


def joined(recording: Recording) -> tuple[Array, Array, Array]:
    """Times (T,), states (T, 2J) and inputs (T, A) of all episodes; NaN between two."""
    parts = []
    for e in recording.episodes:
        states, inputs = np.hstack([e.q, e.dq]), np.where(e.enabled, e.inputs, np.nan)
        gapped = (np.pad(v, ((0, 1), (0, 0)), constant_values=np.nan) for v in (states, inputs))
        parts.append((np.append(e.t, e.t[-1]), *gapped))
    t, x, u = (np.concatenate(column)[:-1] for column in zip(*parts, strict=True))
    return t, x, u


def joints_legend(joints: tuple[str, ...]) -> Markup:
    return legend(*zip(joints, map(Stroke, cycle(COLOURS)), strict=False))


def stepped(t: Array, inputs: Array, joints: tuple[str, ...]) -> dict[str, list]:
    times = np.repeat(t, 2)[1:]
    return _lines([times] * len(joints), [np.repeat(u, 2)[:-1] for u in inputs.T], joints)


def _lines(t: list[Array], values: list[Array], joints: tuple[str, ...]) -> dict[str, list]:
    colours = islice(cycle(COLOURS), len(joints))
    return {'ts': t, 'us': values, 'colour': [*colours], 'joint': [*joints]}
