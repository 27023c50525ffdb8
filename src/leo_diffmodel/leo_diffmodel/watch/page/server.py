# SPDX-License-Identifier: Apache-2.0
"""The page on this machine alone, behind an address that nobody else knows."""

from collections.abc import Callable
import gc
import logging
import secrets
import signal
from typing import NoReturn

from bokeh.document import Document
from bokeh.server.server import Server
from bokeh.util.logconfig import basicConfig
from tornado.ioloop import PeriodicCallback

from leo_diffmodel.watch.page.document import Page
from leo_diffmodel.watch.page.e_stop import HERE
from leo_diffmodel.watch.page.files import routes
from leo_diffmodel.watch.page.leaving import application
from leo_diffmodel.watch.page.library_errors import LibraryErrors
from leo_msgs_py.errors import UserError

OpenTab = Callable[[Document, Page], object]
TOKEN_BYTES = 16
POLL_MS = 200
PAUSE, SHORT_PAUSE = 0.05, 0.01
"""After a change, and between the pieces of what follows: tabs are sent what is new [s]."""


class WatchServer:
    """Serves a page on a port (0: a free one); UserError: it is in use, or not for us.

    Whoever does not know the token, which is the first part of every path, gets 404 for whatever
    is asked.
    """

    def __init__(self, page: Page, port: int, tab: OpenTab) -> None:
        self._page, self._state, self._following = page, page.state, False
        token = secrets.token_urlsafe(TOKEN_BYTES)
        where = {'address': HERE, 'port': port, 'prefix': token}
        pauses = {'keep_alive_milliseconds': 10000, 'check_unused_sessions_milliseconds': 5000}
        files_too = {'extra_patterns': routes(page.state)}
        tabs = application(lambda document: tab(document, page))
        try:
            self._server = Server(tabs, **where, **pauses, **files_too)
        except OSError as error:
            raise UserError(
                f'port {port}: {error.strerror}; give --port another one, or leave it out'
            ) from error
        self.port: int = self._server.port
        self.origin = f'http://localhost:{self.port}'.removesuffix(':80')
        self.url = f'{self.origin}/{token}/'
        page.state.listeners.append(self._follow)

    def every(self, milliseconds: float, action: Callable[[], None]) -> None:
        PeriodicCallback(action, milliseconds).start()

    def end(self) -> None:
        self._server.io_loop.add_callback(self._server.io_loop.stop)

    def run_until_interrupted(self) -> NoReturn:
        """Serve until SIGINT or SIGTERM, then raise KeyboardInterrupt.

        The loop hears them. An exception raised wherever the program is can get lost, as in the
        callback of a weak reference.
        """
        loop = self._server.io_loop
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.asyncio_loop.add_signal_handler(number, loop.stop)
        self.run()
        raise KeyboardInterrupt

    def run(self) -> None:
        """Serve until `end`; then what goes on in other processes is ended too."""
        basicConfig(handlers=[LibraryErrors()])
        logging.getLogger('bokeh.server.views.ws').setLevel(logging.ERROR)  # tabs close
        gc.freeze()  # what is there now stays: Python's collector need not look through it
        self._server.start()
        self.every(POLL_MS, self._poll)
        try:
            self._server.io_loop.start()
        finally:
            for worker in (self._page.finder, self._page.next_run, self._state.drawing):
                worker.stop()
            self._server.stop()

    def _follow(self) -> None:
        """Compute what follows a change, in pieces between which tabs are served."""
        if not self._following:
            self._following = True
            self._server.io_loop.call_later(PAUSE, self._go_on)

    def _go_on(self) -> None:
        self._following = self._state.go_on()
        if self._following:
            self._server.io_loop.call_later(SHORT_PAUSE, self._go_on)

    def _poll(self) -> None:
        self._page.next_run.look()
        finder = self._page.finder
        if not finder.poll():
            return
        if finder.news.answer is not None:
            self._state.found(finder.news.answer)
        else:
            self._state.notify()
