# SPDX-License-Identifier: Apache-2.0
"""The page on this machine alone, behind an address that nobody else knows."""

from __future__ import annotations

from collections.abc import Callable
import secrets
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers import FunctionHandler
from bokeh.server.server import Server
from tornado.ioloop import PeriodicCallback
from tornado.web import RequestHandler

from leo_diffmodel.watch import numbers
from leo_diffmodel.watch.finder import Finder
from leo_diffmodel.watch.page import copy
from leo_diffmodel.watch.page.document import Tab
from leo_diffmodel.watch.state import State
from leo_msgs_py.errors import UserError

HERE = '127.0.0.1'
TOKEN_BYTES = 16
HEAR_MS = 200


class WatchServer:
    """Serves the page of one state until it is stopped.

    Whoever does not know the token, which is the first part of every path, gets 404 for whatever
    is asked.

    Args:
        state: what is shown.
        finder: the search behind 'find it for me'.
        command: `leo add MODEL` as it would be typed.
        port: to listen on; 0 takes a free one.

    Raises:
        UserError: the port is in use, or not for us.
    """

    def __init__(self, state: State, finder: Finder, command: list[str], port: int = 0) -> None:
        self._state, self._finder = state, finder
        self.token = secrets.token_urlsafe(TOKEN_BYTES)
        application = Application(FunctionHandler(
            lambda document: _open(document, state, finder, command)))  # fmt: skip
        files = [_file('numbers.csv', 'text/csv', lambda: numbers.table(state)),
                 _file('copy.html', 'text/html', lambda: copy.page(state))]  # fmt: skip
        try:
            self._server = Server({'/': application}, address=HERE, port=port, prefix=self.token,
                                  extra_patterns=files, keep_alive_milliseconds=10000,
                                  check_unused_sessions_milliseconds=5000)  # fmt: skip
        except OSError as error:
            raise UserError(
                f'port {port}: {error.strerror}; give --port another one, or leave it out'
            ) from error
        self.port: int = self._server.port
        self.url = f'http://localhost:{self.port}/{self.token}/'
        self._hear = PeriodicCallback(self._heard, HEAR_MS)

    def run(self) -> None:
        """Serve until interrupted; then the search, if any, is ended too."""
        self._server.start()
        self._hear.start()
        try:
            self._server.io_loop.start()
        finally:
            self._finder.stop()
            self._server.stop()

    def _heard(self) -> None:
        """Pass on what the search says to all tabs."""
        if not self._finder.hear():
            return
        if self._finder.news.answer is not None:
            self._state.found(self._finder.news.answer)
        else:
            self._state.tell()


def _open(document: Any, state: State, finder: Finder, command: list[str]) -> None:
    Tab(document, state, finder, command)


def _file(name: str, kind: str, content: Callable[[], str]) -> tuple[str, type[RequestHandler]]:
    """A file that is made when it is asked for."""

    class File(RequestHandler):
        def get(self) -> None:
            self.set_header('Content-Type', f'{kind}; charset=utf-8')
            self.set_header('Cache-Control', 'no-store')
            self.finish(content())

    return f'/{name}', File
