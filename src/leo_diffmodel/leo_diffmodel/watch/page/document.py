# SPDX-License-Identifier: Apache-2.0
"""One tab: all parts of the page, following the one state."""

from __future__ import annotations

from bokeh.document import Document
from bokeh.layouts import column, row
from bokeh.models import Div
import jinja2

from leo_diffmodel.report.page import source
from leo_diffmodel.watch.finder import Finder
from leo_diffmodel.watch.page.actions import ActionsView
from leo_diffmodel.watch.page.catalogue import CatalogueView
from leo_diffmodel.watch.page.horizon import HorizonView
from leo_diffmodel.watch.page.look import PAGE, SIDE, TEXT
from leo_diffmodel.watch.page.over_time import OverTimeView
from leo_diffmodel.watch.page.part import Part
from leo_diffmodel.watch.page.robot import RobotView
from leo_diffmodel.watch.state import State

FRAME_MS = 50


class Tab:
    """Puts the parts on a document and keeps them up to date."""

    def __init__(self, document: Document, state: State, finder: Finder,
                 command: list[str]) -> None:
        self._document, self._state, self._waiting = document, state, False
        self._robot, self._over_time = RobotView(state), OverTimeView(state)
        self._over_time.follow_taps()  # before it is on the document, which asks only then
        horizon, catalogue = HorizonView(state), CatalogueView(state)
        actions = ActionsView(state, finder, command)
        self._parts: list[Part] = [self._robot, horizon, self._over_time, catalogue, actions]
        main = column(row(self._robot.root, horizon.root, spacing=12,
                          sizing_mode='stretch_width'),
                      self._over_time.root, spacing=12, sizing_mode='stretch_width')  # fmt: skip
        side = column(actions.root, catalogue.root, spacing=12, width=SIDE)
        document.add_root(column(
            Div(text=_headline(state), stylesheets=[TEXT]),
            row(main, side, spacing=12, sizing_mode='stretch_width'),
            margin=14, sizing_mode='stretch_width',
        ))  # fmt: skip
        document.title = f'{state.scene.model.robot.name}: leo watch'
        document.template = jinja2.Template(PAGE)
        self._begin()

    def _begin(self) -> None:
        self._state.listeners.append(self._changed)
        self._document.add_periodic_callback(self._tick, FRAME_MS)
        self._document.on_session_destroyed(lambda _: self._end())

    def _end(self) -> None:
        self._state.listeners.remove(self._changed)

    def _changed(self) -> None:
        """Show what changed as soon as this tab's turn comes, once for several changes."""
        if not self._waiting:
            self._waiting = True
            self._document.add_next_tick_callback(self._refresh)

    def _refresh(self) -> None:
        self._waiting = False
        for part in self._parts:
            part.refresh()

    def _tick(self) -> None:
        if self._state.player.playing:
            self._robot.tick()
            self._over_time.tick()


def _headline(state: State) -> str:
    robot, data = state.scene.given.robot.name, source(state.scene.recordings)
    return (f'<b class="big">{robot}</b> <span class="muted">{data}: switch an effect on and '
            'watch the error fall</span>')  # fmt: skip
