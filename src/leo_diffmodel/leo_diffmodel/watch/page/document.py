# SPDX-License-Identifier: Apache-2.0
"""One tab: all parts of the page, following the one state."""

from dataclasses import dataclass
from typing import Any

from bokeh.document import Document
from bokeh.events import DocumentReady
from bokeh.layouts import column
from markupsafe import Markup

from leo_diffmodel.report.page import template
from leo_diffmodel.report.text import source
from leo_diffmodel.watch.next_run import NextRun
from leo_diffmodel.watch.page import look
from leo_diffmodel.watch.page.errors import HorizonView, OverTimeView
from leo_diffmodel.watch.page.look import AT_SIDE, GAP, MARGIN, said, WIDE, wrapped
from leo_diffmodel.watch.page.missing import MissingView, WhereView
from leo_diffmodel.watch.page.next_run import NextRunView
from leo_diffmodel.watch.page.robot import RobotView
from leo_diffmodel.watch.page.switches import ActionsView, CatalogueView
from leo_diffmodel.watch.state import State
from leo_diffmodel.watch.worker import Finder

FRAME_MS = 50
DRAWN_MS = 60  # a browser has drawn the curves of a change after so long


@dataclass(frozen=True)
class Page:
    """What all tabs show and do; `command` is `leo add MODEL` as it would be typed."""

    state: State
    finder: Finder
    command: list[str]
    next_run: NextRun


class Tab:
    def __init__(self, document: Document, page: Page) -> None:
        self._document, self._state = document, page.state
        state = page.state
        self._waiting = self._following = False
        self._robot, self._over_time = RobotView(state), OverTimeView(state)
        where, missing = WhereView(state), MissingView(state)
        horizon, self._catalogue = HorizonView(state), CatalogueView(state)
        actions = ActionsView(state, page.finder, page.command)
        run = NextRunView(page.next_run)
        curves, others = (horizon, self._robot, self._over_time), (where, missing, actions, run)
        self._curves = [part.refresh for part in curves]
        self._others = [horizon.say, self._catalogue.refresh, *(part.refresh for part in others)]
        upper = wrapped((self._robot.root, look.PLOT), (horizon.root, look.PLOT), spacing=GAP)
        below = self._over_time.root, where.root, missing.root, run.root
        self._main: Any = column(upper, *below, spacing=GAP, **WIDE)
        side = column(
            actions.root, self._catalogue.root, spacing=GAP, stylesheets=[AT_SIDE], **WIDE
        )
        side.styles = {'flex': f'0 1 {look.SIDE}px'}
        both = wrapped((self._main, look.MAIN), (side, look.SIDE), spacing=GAP)
        document.add_root(column(said(_headline(state)), both, margin=MARGIN, **WIDE))
        document.title = f'{state.scene.model.robot.name}: leo watch'
        document.template = template('live.html')
        state.listeners.append(self._changed)
        document.add_periodic_callback(self._tick, FRAME_MS)
        document.on_session_destroyed(lambda _: state.listeners.remove(self._changed))
        document.on_event(DocumentReady, lambda _: self._drawn())

    def _drawn(self) -> None:
        """What can wait until the page is drawn: the rest of the catalogue, what follows."""
        if self._catalogue.lengthen():
            self._document.add_next_tick_callback(self._drawn)
        else:
            self._state.notify()

    def _changed(self) -> None:
        if not self._waiting:
            self._waiting = True
            self._document.add_next_tick_callback(self._draw)

    def _draw(self) -> None:
        """Draw the curves first: what is laid out anew afterwards keeps a browser busy."""
        self._waiting = False
        for refresh in self._curves:
            refresh()
        if not self._following:
            self._following = True
            self._document.add_timeout_callback(self._follow, DRAWN_MS)

    def _follow(self) -> None:
        self._following = False
        for refresh in self._others:
            refresh()

    def _tick(self) -> None:
        if self._state.player.playing:
            self._robot.tick()
            self._over_time.tick()


def _headline(state: State) -> Markup:
    robot, data = state.scene.given.robot.name, source(state.scene.recordings)
    return Markup(
        '<b class="big">{}</b> <span class="muted">{}: switch an effect on and '
        'watch the error fall</span>'
    ).format(robot, data)
