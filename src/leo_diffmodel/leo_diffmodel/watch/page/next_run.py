# SPDX-License-Identifier: Apache-2.0
"""What to record next: the run as a curve, which effects it separates, and where it is."""

from __future__ import annotations

from typing import Any

from bokeh.layouts import column, row
from bokeh.models import Button, ColumnDataSource
from markupsafe import Markup
import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.next_run.run_file import input_units
from leo_diffmodel.next_run.settings import NEXT
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas
from leo_diffmodel.watch.next_run import NextRun, Plan
from leo_diffmodel.watch.page.look import CARD, legend, said, small, WIDE, wrong
from leo_msgs_py.terminal import leo

Array = np.ndarray
HEIGHT = 170
COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9')
NO_LINES: dict[str, list] = {'ts': [], 'us': [], 'colour': [], 'joint': []}
ON_ROBOT = 'on the robot, recorded'
NOTE = (
    'Motion as the model with what was named predicts it, of a scripted motion the first '
    f'{NEXT.tried_seconds:g} s. Gaps: the motors are off, or the robot is put up again.'
)


class NextRunView:
    """A button, the proposal, and its curves while there are some."""

    def __init__(self, next_run: NextRun) -> None:
        self._next = next_run
        self._ask = Button(label='What to record next', width=200, name='next run')
        self._ask.on_click(self._asked)
        self._words = said(name='next run says', **WIDE)
        self._inputs = ColumnDataSource(NO_LINES, name='next run inputs')
        self._motion = ColumnDataSource(NO_LINES, name='next run motion')
        self._shown: Plan | None = None
        self._plots = self._two()
        self._legend = said()
        note = said(small(NOTE))
        self._curves = column(*self._plots, self._legend, note, **WIDE)
        parts = row(self._ask), self._words, self._curves
        self.root = column(*parts, stylesheets=[CARD], **WIDE)
        self.refresh()

    def refresh(self) -> None:
        """Show how far it is, or what is proposed."""
        plan = self._next.plan
        self._ask.disabled = self._next.busy or bool(self._next.hindrance)
        self._words.text = Markup().join(map(Markup('<div>{}</div>').format, self._lines()))
        if plan is not self._shown:
            self._shown = plan
            self._draw(plan)
        self._curves.visible = plan is not None and plan.predicted is not None

    def _asked(self) -> None:
        self._next.start()
        self.refresh()

    def _lines(self) -> list[str]:
        """What is said, as HTML."""
        news, plan = self._next.news, self._next.plan
        if self._next.busy:
            return [f'choosing a run, {news.count}: {news.text} …']
        if plan is None:
            hindrance = self._next.hindrance
            if news.error and not hindrance:
                return [wrong(news.error)]
            return [small(hindrance)] if hindrance else []
        return [*plan.words, *self._files()]

    def _files(self) -> list[str]:
        """Where the run is, and how it is played."""
        file = self._next.file
        lines: list[str] = [Markup('wrote <code>{}</code>').format(file)] if file else []
        if self._next.said:
            lines.append(wrong(self._next.said))
        if self._next.words:
            command = leo(*self._next.recorded)
            lines.append(Markup('{}: <code>{}</code>').format(ON_ROBOT, command))
        return lines

    def _two(self) -> tuple[Any, Any]:
        """Inputs above the motion, on one axis of time."""
        above = canvas('', '', height=HEIGHT, name='next run plot')
        below = canvas('time [s]', '', height=HEIGHT, x_range=above.x_range)
        for plot, source in ((above, self._inputs), (below, self._motion)):
            plot.multi_line('ts', 'us', source=source, line_color='colour', line_width=1.5)
        return above, below

    def _draw(self, plan: Plan | None) -> None:
        if plan is None or plan.predicted is None:
            return
        track = plan.predicted
        driven = [track.joints.index(a) for a in track.actuators]
        left_out = {*track.actuators, *plan.robot.base_joints}
        shown = driven + [k for k, name in enumerate(track.joints) if name not in left_out]
        names = tuple(track.joints[k] for k in shown)
        t, x, inputs = joined(track)
        self._inputs.data = stepped(t, inputs, track.actuators)
        self._motion.data = _lines([t] * len(names), [*x[:, shown].T], names)
        self._plots[0].yaxis.axis_label = f'input [{input_units(plan.robot)}]'
        lengths = dict.fromkeys(length_unit(plan.robot, name) for name in names)
        self._plots[1].yaxis.axis_label = f'position [{" or ".join(lengths)}]'
        self._legend.text = joints_legend(names)


def joined(recording: Recording) -> tuple[Array, Array, Array]:
    """Times (T,), states (T, 2J) and inputs (T, A) of all episodes; NaN between two."""
    parts: list[tuple[Array, ...]] = [
        (e.t, np.hstack([e.q, e.dq]), np.where(e.enabled, e.inputs, np.nan))
        for e in recording.episodes
    ]
    rows = [parts[0]]
    for part in parts[1:]:
        end, *values = rows[-1]
        rows += [(end[-1:], *(np.full_like(v[:1], np.nan) for v in values)), part]
    t, x, u = (np.concatenate(column) for column in zip(*rows, strict=True))
    return t, x, u


def joints_legend(joints: tuple[str, ...]) -> Markup:
    """Which line is whose, as HTML."""
    return legend(
        *((name, Stroke(colour)) for name, colour in zip(joints, _colours(joints), strict=True))
    )


def stepped(t: Array, inputs: Array, joints: tuple[str, ...]) -> dict[str, list]:
    """A stepped line for each actuator."""
    times = np.repeat(t, 2)[1:]
    return _lines([times] * len(joints), [np.repeat(u, 2)[:-1] for u in inputs.T], joints)


def _lines(t: list[Array], values: list[Array], joints: tuple[str, ...]) -> dict[str, list]:
    return {'ts': t, 'us': values, 'colour': _colours(joints), 'joint': [*joints]}


def _colours(joints: tuple[str, ...]) -> list[str]:
    """Of the lines of some joints."""
    return [COLOURS[k % len(COLOURS)] for k in range(len(joints))]
