# SPDX-License-Identifier: Apache-2.0
"""What to record next: the run as a curve, what it would tell apart, and where it is."""

from __future__ import annotations

from typing import Any

from bokeh.layouts import column, row
from bokeh.models import Button, ColumnDataSource
from markupsafe import Markup

from leo_diffmodel.next_run.menu import TRIED_SECONDS
from leo_diffmodel.report.canvas import canvas
from leo_diffmodel.watch.next_run import NextRun
from leo_diffmodel.watch.page.look import CARD, said, small, wrong
from leo_diffmodel.watch.page.strips import colour, joined, joints_legend, stepped, UNITS
from leo_diffmodel.watch.plan import Plan
from leo_msgs_py.terminal import leo

HEIGHT = 170
ON_ROBOT = 'on the robot, recorded'
NOTE = (
    'Motion as the model with what was named predicts it, of a scripted motion the first '
    f'{TRIED_SECONDS:g} s. Gaps: the motors are off, or the robot is put up again.'
)


class NextRunView:
    """A button, the proposal, and its curves while there are some."""

    def __init__(self, next_run: NextRun) -> None:
        self._next = next_run
        self._ask = Button(label='What to record next', width=200, name='next run')
        self._ask.on_click(self._asked)
        self._words = said(name='next run says', sizing_mode='stretch_width')
        empty: dict[str, list] = {'ts': [], 'us': [], 'colour': [], 'joint': []}
        self._inputs = ColumnDataSource(empty, name='next run inputs')
        self._motion = ColumnDataSource(empty, name='next run motion')
        self._shown: Plan | None = None
        self._plots = self._two()
        self._legend = said()
        note = said(small(NOTE))
        self._curves = column(*self._plots, self._legend, note, sizing_mode='stretch_width')
        self.root = column(
            row(self._ask),
            self._words,
            self._curves,
            stylesheets=[CARD],
            sizing_mode='stretch_width',
        )
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
        below = canvas('time [s]', 'angle [rad]', height=HEIGHT, x_range=above.x_range)
        for plot, source in ((above, self._inputs), (below, self._motion)):
            plot.multi_line('ts', 'us', source=source, line_color='colour', line_width=1.5)
        return above, below

    def _draw(self, plan: Plan | None) -> None:
        if plan is None or plan.predicted is None:
            return
        track = plan.predicted
        driven = [track.joints.index(a) for a in track.actuators]
        others = [
            k
            for k in range(len(track.joints))
            if k not in driven and track.joints[k] not in plan.robot.base_joints
        ]
        names = tuple(track.joints[k] for k in (*driven, *others))
        t, x, inputs = joined(track)
        self._inputs.data = stepped(t, inputs, track.actuators)
        self._motion.data = {
            'ts': [t] * len(names),
            'us': [*x[:, [*driven, *others]].T],
            'colour': [colour(k) for k in range(len(names))],
            'joint': [*names],
        }
        self._plots[0].yaxis.axis_label = f'input [{UNITS[track.input]}]'
        self._legend.text = joints_legend(names)
