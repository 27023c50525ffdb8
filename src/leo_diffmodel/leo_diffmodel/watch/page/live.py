# SPDX-License-Identifier: Apache-2.0
"""A running robot on the page: how it is, what it measures and gets, e-stop and recording."""

from __future__ import annotations

from typing import Any

from bokeh.document import Document
from bokeh.layouts import column, row
from bokeh.models import Button
from markupsafe import Markup

from leo_diffmodel.picture import palette
from leo_diffmodel.watch.errand import Finder
from leo_diffmodel.watch.live.beside import Beside
from leo_diffmodel.watch.next_run import NextRun
from leo_diffmodel.watch.page.document import Tab
from leo_diffmodel.watch.page.look import CARD, said, small
from leo_diffmodel.watch.page.sending import SendView
from leo_diffmodel.watch.page.strips import StripsView
from leo_diffmodel.watch.state import State
from leo_msgs_py.errors import UserError

ROOM = 106
"""For five lines, so that what is below stays where it is [px]."""
LOOK_MS = 250
"""How often a tab looks how the robot is."""


class LiveView:
    """What the robot says of itself, and buttons that reach it."""

    def __init__(self, state: State, beside: Beside) -> None:
        self._beside, self._strips = beside, StripsView(state)
        self._stop = Button(label='E-STOP', button_type='danger', width=120, name='e-stop')
        self._release = Button(label='Release e-stop', width=120, name='release')
        self._record = Button(label='', width=120, name='record')
        self._freeze = Button(label='', width=120, name='freeze')
        self._words = said(name='robot says', sizing_mode='stretch_width', min_height=ROOM)
        self._connect()
        buttons = row(self._stop, self._release, self._record, self._freeze)
        self.root = column(
            row(buttons, self._words, sizing_mode='stretch_width'),
            self._strips.root,
            stylesheets=[CARD],
            margin=(0, 0, 12, 0),
            sizing_mode='stretch_width',
        )
        self.refresh()

    def refresh(self) -> None:
        """Draw the newest data, and say how the robot is."""
        self._strips.refresh()
        self.tick()

    def tick(self) -> None:
        """Say how the robot is, and what the buttons would do."""
        beside = self._beside
        self._release.disabled = not beside.robot.condition.e_stopped
        self._record.disabled = not beside.recording.possible
        self._record.label = 'Stop recording' if beside.recording.on else 'Record'
        self._freeze.label = 'Go on' if beside.renewing.frozen else 'Hold the data'
        self._words.text = self._said()

    def _connect(self) -> None:
        beside = self._beside
        self._stop.on_click(beside.robot.e_stop)
        self._release.on_click(beside.robot.release)
        self._record.on_click(self._recorded)
        self._freeze.on_click(lambda: beside.renewing.freeze(not beside.renewing.frozen))

    def _recorded(self) -> None:
        try:
            self._beside.switch_recording()
        except (UserError, OSError) as error:
            self._beside.said = str(error)
        self.tick()

    def _said(self) -> Markup:
        lines = self._beside.lines()
        colour = palette.INK if lines.well else '#8f3d00'
        first = Markup('<b style="color:{}">{}</b>').format(colour, lines.robot)
        return Markup('<br>').join([first, *map(small, lines.more)])


class LiveTab(Tab):
    """The page with the robot on top of it."""

    def __init__(
        self,
        document: Document,
        state: State,
        finder: Finder,
        command: list[str],
        beside: Beside,
        next_run: NextRun | None = None,
    ) -> None:
        super().__init__(document, state, finder, command, next_run)
        self._live = LiveView(state, beside)
        self._parts.append(self._live)
        page: Any = document.roots[0]
        page.children = [page.children[0], self._live.root, *page.children[1:]]
        document.add_periodic_callback(self._live.tick, LOOK_MS)
        if next_run is not None:
            send = SendView(next_run, beside)
            self._put_below(send)
            document.add_periodic_callback(send.refresh, LOOK_MS)
