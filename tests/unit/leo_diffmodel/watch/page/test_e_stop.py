# SPDX-License-Identifier: Apache-2.0
"""The e-stop of the page, asked for as a browser does."""

from http.client import HTTPConnection
from threading import Event, Thread
import time
from unittest.mock import Mock
from urllib.parse import urlsplit

from bokeh.client import pull_session
import pytest

from leo_diffmodel.watch.page.document import Page
from leo_diffmodel.watch.page.e_stop import own_way
from leo_diffmodel.watch.page.live import LiveView
from leo_diffmodel.watch.page.server import WatchServer
from leo_diffmodel.watch.state import State

BUSY, SOON = 10.0, 1.0
"""How long the page's loop does nothing else at most, and how soon the robot is stopped [s]."""
PAGE = 'http://localhost:5006'


@pytest.fixture
def stopped():
    return Event()


@pytest.fixture
def page(scene, stopped):
    """A page with the buttons of a running robot, served in a thread."""
    state, made, there = State(scene), [], Event()
    live = Mock(**{'lines.return_value': (True, ['running'])})
    live.robot.e_stop = live.robot.release = live.renewing.toggle = live.switch_recording = print

    def serve() -> None:
        page = Page(state, Mock(**{'poll.return_value': False}), [], Mock())
        server = WatchServer(page, 0, lambda tab, _: tab.add_root(LiveView(live).root))
        with own_way(lambda: stopped.set() or '', server.origin) as live.e_stop_url:
            made.append(server)
            server.every(10, there.set)
            server.run()

    thread = Thread(target=serve)
    thread.start()
    there.wait()
    yield made[0]
    made[0].end()
    thread.join()


def ask(url: str, method: str = 'POST', **headers: str) -> tuple[int, str, str]:
    """What is answered: the status, the words, and which page may read them."""
    parts = urlsplit(url)
    connection = HTTPConnection(parts.netloc, timeout=BUSY)
    connection.request(method, parts.path, headers=headers)
    answer = connection.getresponse()
    return answer.status, answer.read().decode(), answer.headers['Access-Control-Allow-Origin']


def test_it_stops_the_robot_while_the_pages_server_is_busy(page, stopped):
    button = pull_session(url=page.url).document.get_model_by_name('e-stop')
    busy, end = Event(), time.monotonic() + BUSY

    def block() -> None:
        busy.set()
        while time.monotonic() < end and not stopped.is_set():
            sum(range(1000))

    page._server.io_loop.add_callback(block)
    busy.wait()
    (in_browser,) = button.js_event_callbacks['button_click']
    began = time.monotonic()
    assert ask(in_browser.args['url'], Origin=page.origin) == (200, '', page.origin)
    assert stopped.is_set() and time.monotonic() - began < SOON


def test_why_it_is_not_known_to_have_stopped_is_the_answer():
    with own_way(lambda: 'no service <answers>', PAGE) as url:
        assert ask(url, Origin=PAGE) == (200, 'no service <answers>', PAGE)


@pytest.mark.parametrize(
    ('method', 'more', 'headers'),
    [
        ('GET', '', {'Origin': PAGE}),
        ('POST', 'x', {'Origin': PAGE}),
        ('POST', '', {}),
        ('POST', '', {'Origin': 'http://localhost:5007'}),
        ('POST', '', {'Origin': PAGE, 'Host': 'elsewhere.example'}),
    ],
)
def test_nothing_but_its_own_page_can_ask(method, more, headers, stopped, capfd):
    with own_way(lambda: stopped.set() or '', PAGE) as url:
        status, _, reader = ask(url + more, method, **headers)
    assert status in (403, 501) and reader is None and not stopped.is_set()
    assert capfd.readouterr().err == ''
