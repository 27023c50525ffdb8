# SPDX-License-Identifier: Apache-2.0
"""A running robot on the page: how it is, its signals, e-stop, recording, sending it a run."""

from typing import Any

from bokeh.document import Document
from bokeh.layouts import row
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure
from markupsafe import Markup
import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.next_run.run_file import input_units
from leo_diffmodel.picture import palette
from leo_diffmodel.report.canvas import canvas
from leo_diffmodel.watch.live.commands import Sent
from leo_diffmodel.watch.live.live import Live, STOPPED
from leo_diffmodel.watch.next_run import NextRun
from leo_diffmodel.watch.page import look
from leo_diffmodel.watch.page import next_run as proposing
from leo_diffmodel.watch.page.document import Page, Tab
from leo_diffmodel.watch.page.e_stop import pressed
from leo_diffmodel.watch.page.look import button, legend, ROBOTS, said, small, WIDE, WORDS, wrong
from leo_diffmodel.watch.state import State
from leo_diffmodel.watch.view import MODELS, unit

ROOM = 106  # for five lines, so that what is below stays where it is [px]
LOOK_MS = 250  # how often a tab looks how the robot is
RECORDED = 'It is recorded into {}.'
NOT_RECORDED = 'It is not recorded: press Record first to keep what it shows.'


class LiveView:
    def __init__(self, live: Live) -> None:
        self._live = live
        stop = button('E-STOP', 'e-stop', live.robot.e_stop, button_type='danger', width=120)
        stop.js_on_click(pressed(live.e_stop_url))
        self._release = button('Release e-stop', 'release', live.robot.release, width=120)
        self._record = button('', 'record', live.switch_recording, self.refresh, width=120)
        self._freeze = button('', 'freeze', live.renewing.toggle, width=120)
        self._words = said(name='robot says', **WIDE, min_height=ROOM)
        buttons = row(stop, self._release, self._record, self._freeze, stylesheets=[look.WRAP])
        head = look.wrapped((buttons, WORDS), (self._words, WORDS))
        self.root = look.card(head, margin=(0, 0, look.GAP, 0))
        self.refresh()

    def refresh(self) -> None:
        live = self._live
        self._release.disabled = not live.robot.condition.e_stopped
        self._record.disabled = not live.recording.possible
        self._record.label = 'Stop recording' if live.recording.on else 'Record'
        self._freeze.label = 'Go on' if live.renewing.frozen else 'Hold the data'
        self._words.text = self._said()

    def _said(self) -> Markup:
        well, (robot, *more) = self._live.lines()
        first = Markup('<b>{}</b>').format(robot if well else wrong(robot))
        return Markup('<br>').join([first, *map(small, more)])


class SendView:
    def __init__(self, next_run: NextRun, live: Live) -> None:
        self._next, self._live = next_run, live
        orange = {'button_type': 'warning', 'width': 200}
        red = {'button_type': 'danger', 'width': 200}
        self._send = button('', 'send', self._pressed, self.refresh, **orange)
        yes = button('Yes, move the robot', 'yes, move', live.send, self.refresh, **red)
        no = button('No', 'no, do not move', live.sending.no, self.refresh, width=80)
        self._words = said(**WIDE, name='sending')
        self._answers = row(yes, no, stylesheets=[look.WRAP])
        self.root = look.card(row(self._send, self._answers, stylesheets=[look.WRAP]), self._words)
        self.refresh()

    def refresh(self) -> None:
        sending = self._live.sending
        self._send.label = 'Stop the run' if sending.on else 'Send to the robot'
        self._send.visible = sending.on or bool(self._next.words)
        self._send.disabled = not sending.on and (sending.question is not None or self._stopped)
        self.root.visible = self._send.visible or bool(sending.words)
        self._answers.visible = sending.question is not None
        self._words.text = Markup('<b>{}</b>').format(self._asked())

    @property
    def _stopped(self) -> bool:
        return bool(self._live.robot.condition.e_stopped)

    def _pressed(self) -> None:
        sending, plan = self._live.sending, self._next.plan
        if sending.on:
            sending.stop()
        elif plan is not None and plan.run is not None and self._next.words:
            sending.ask(Sent(tuple(self._next.words), plan.run.name, plan.seconds))

    def _asked(self) -> str:
        sending, recording = self._live.sending, self._live.recording
        if (run := sending.question) is None:
            return ' '.join(filter(None, [sending.words, STOPPED if self._stopped else '']))
        kept = RECORDED.format(recording.bag) if recording.on else NOT_RECORDED
        return f'The robot will move for {run.seconds:.0f} s: "{run.name}". {kept} Go on?'


class StripsView:
    def __init__(self, state: State) -> None:
        self._state = state
        self._measured = ColumnDataSource({'t': [], 'x': []}, name='live measured')
        self._ahead = ColumnDataSource({'t': [], 'given': [], 'now': []}, name='live predicted')
        self._inputs = ColumnDataSource(proposing.NO_LINES, name='live inputs')
        self._upper = self._states()
        labels = f'applied [{input_units(state.scene.model.robot)}]', 'live applied'
        lower = proposing.lines_canvas(
            'before the newest sample [s]', *labels, self._inputs, x_range=self._upper.x_range
        )
        joints = proposing.joints_legend(state.scene.recordings[-1].actuators)
        self.root = look.card(said(legend(*ROBOTS)), self._upper, lower, said(joints))
        self.refresh()

    def refresh(self) -> None:
        state, i = self._state, self._state.shown
        recording, film = state.scene.recordings[-1], state.film
        t, x, inputs = proposing.joined(recording)
        end = t[-1]
        self._measured.data = {'t': t - end, 'x': x[:, i]}
        first = recording.episodes[0].t[0]
        self._ahead.data = {
            't': _with_gaps(film.time + first - end),
            'given': _with_gaps(film.given[..., i]),
            'now': _with_gaps(film.repaired[..., i]),
        }
        self._inputs.data = proposing.stepped(t - end, inputs, recording.actuators)
        self._upper.yaxis.axis_label = unit(state)

    def _states(self) -> figure:
        plot = canvas('', '', height=proposing.HEIGHT, name='live states')
        for name, stroke, _ in MODELS:
            line = {'line_color': stroke.colour, 'line_width': 2, 'line_dash': stroke.dash}
            plot.line('t', name, source=self._ahead, **line)
        plot.line('t', 'x', source=self._measured, line_color=palette.INK, line_width=1.5)
        return plot


def _with_gaps(windows: Array) -> Array:
    """Windows (W, K+1) one after the other, NaN after each."""
    return np.pad(windows, ((0, 0), (0, 1)), constant_values=np.nan).ravel()


class LiveTab(Tab):
    def __init__(self, document: Document, page: Page, live: Live) -> None:
        super().__init__(document, page)
        robot, strips, send = LiveView(live), StripsView(page.state), SendView(page.next_run, live)
        root: Any = document.roots[0]
        self._others += [robot.refresh, strips.refresh, send.refresh]
        root.children = [root.children[0], robot.root, *root.children[1:]]
        self._main.children = [strips.root, *self._main.children, send.root]
        document.add_periodic_callback(robot.refresh, LOOK_MS)
        document.add_periodic_callback(send.refresh, LOOK_MS)
