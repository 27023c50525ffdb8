# SPDX-License-Identifier: Apache-2.0
"""The e-stop's own way from a browser to the robot, whatever the page's server is busy with."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hmac import compare_digest
from http.server import BaseHTTPRequestHandler
import secrets
from socketserver import ThreadingTCPServer
import sys
from threading import Thread
from typing import Any, cast

from bokeh.models import CustomJS

from leo_diffmodel.report.page import template

HERE = '127.0.0.1'
IDLE = 2.0  # a connection that says nothing is closed after so long [s]
TURN = 5e-4  # a thread of Python gives way to a waiting one after so long [s]; by itself 5e-3


def pressed(url: str) -> CustomJS:
    """What a browser does by itself when the button is pressed."""
    return CustomJS(args={'url': url}, code=template('e_stop.js').render())


@contextmanager
def own_way(stop: Callable[[], str], page: str) -> Iterator[str]:
    """Serve the e-stop to the page of an origin, in a thread of its own, at the URL yielded.

    `stop` says why the robot is not known to have stopped, '' where it is.
    """
    usual = sys.getswitchinterval()
    sys.setswitchinterval(TURN)
    with _Server(stop, page) as server:
        Thread(target=server.serve_forever, name='e-stop', daemon=True).start()
        try:
            yield f'http://{server.host}{server.path}'
        finally:
            server.shutdown()
            sys.setswitchinterval(usual)


class _Server(ThreadingTCPServer):
    daemon_threads = True
    request_queue_size = 128

    def __init__(self, stop: Callable[[], str], page: str) -> None:
        super().__init__((HERE, 0), _Handler)
        self.stop, self.page = stop, page
        self.host = f'{HERE}:{self.server_address[1]}'
        self.path = f'/{secrets.token_urlsafe()}'

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Who leaves without an answer is no error."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    timeout = IDLE

    def do_POST(self) -> None:
        server = cast(_Server, self.server)
        known = compare_digest(self.path.encode(), server.path.encode())
        named = self.headers.get('Host'), self.headers.get('Origin')
        if not known or named != (server.host, server.page):
            self.send_error(403)
            return
        words = server.stop().encode()
        self.send_response(200)
        self.send_header('Access-Control-Allow-Origin', server.page)
        self.send_header('Content-Type', 'text/plain; charset=utf-8')
        self.send_header('Content-Length', str(len(words)))
        self.end_headers()
        self.wfile.write(words)

    def log_message(self, *_: Any) -> None:
        """A terminal is not told of every request."""
