# SPDX-License-Identifier: Apache-2.0
"""The page of leo watch as a browser's session sees it, from the command as it is typed."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
import json
from logging import Logger
from pathlib import Path
import re
import signal
import socket
import subprocess
from unittest.mock import Mock
from urllib.error import HTTPError
from urllib.request import urlopen

from bokeh.client import pull_session
import numpy as np
from PIL import Image
import pytest
from tests.commands import LEO
from tests.page import Links, read
from tests.patience import PATIENCE, until
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.bags.recorder import Recorder
from leo_diffmodel.bags.types import Topic
from leo_diffmodel.verbs.watch import main
from leo_diffmodel.watch.page.leaving import application
from leo_diffmodel.watch.page.library_errors import LibraryErrors
from leo_diffmodel.watch.page.server import HERE
from leo_msgs_py.bag_contents import load
from leo_msgs_py.errors import UserError
from leo_sim.effects import place

EFFECT = 'coulomb_friction:pivot'
MODEL = ['--model', 'torque_pendulum', '--no-browser', '--json']


@pytest.fixture(scope='module')
def run(tmp_path_factory) -> Path:
    effect = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    return bag(tmp_path_factory.mktemp('watch') / 'run', record(TORQUE, effect, seconds=16))


@pytest.fixture(scope='module')
def url(run):
    with subprocess.Popen([LEO, 'watch', run, *MODEL], stdout=subprocess.PIPE, text=True) as leo:
        yield json.loads(leo.stdout.readline())['url']
        leo.send_signal(signal.SIGINT)
        assert leo.wait(PATIENCE) == 130


class Tab:
    def __init__(self, url):
        self._url, self._session = url, pull_session(url=url)

    def set(self, name, **values):
        with self._again() as session:
            session.document.get_model_by_name(name).update(**values)
            session.force_roundtrip()

    def get(self, name, what):
        with self._again() as session:
            return getattr(session.document.get_model_by_name(name), what)

    @property
    def error(self) -> float:
        return float(re.search(r'→ ([\d.]+)</b>', self.get('error', 'text'))[1])

    @property
    def curve(self) -> dict:
        return self.get('error against horizon', 'data')

    def _again(self):
        return pull_session(url=self._url, session_id=self._session.id)


@pytest.fixture
def tab(url):
    return Tab(url)


def test_a_tab_is_closed_without_a_look_through_all_objects(monkeypatch):
    monkeypatch.setattr('gc.collect', lambda: pytest.fail('looked'))
    left, tabs = [], application(lambda opened: opened.on_session_destroyed(left.append))
    context = Mock(_document=tabs.create_document())
    asyncio.run(tabs.on_session_destroyed(context))
    context._document.on_change_dispatch_to(context)
    context._document.destroy(context)
    assert left == [context]


def test_a_switch_a_slider_and_a_typed_value_move_the_curve_in_every_tab(url, tab):
    before, other = tab.error, Tab(url)
    np.testing.assert_array_equal(tab.curve['now'], tab.curve['given'])
    tab.set(f'switch {EFFECT}', active=True)
    until(lambda: tab.error < 1.2 < before)
    assert tab.curve['now'][-1] < 0.3 * tab.curve['given'][-1]
    until(lambda: other.get(f'switch {EFFECT}', 'active') and other.error == tab.error)
    good, there = tab.error, tab.get(f'slider {EFFECT} c', 'value')
    tab.set(f'slider {EFFECT} c', value=0.9)
    until(lambda: other.error == tab.error > 3 * good)
    other.set(f'slider {EFFECT} c', value=there)
    until(lambda: other.error == tab.error == good)
    tab.set(f'value {EFFECT} c', value=0.25)
    until(lambda: 'c=0.25 ' in tab.get('said', 'text'))
    other.set(f'switch {EFFECT}', active=False)
    until(lambda: tab.error == before and not tab.get(f'switch {EFFECT}', 'active'))
    until(lambda: 'c=0.25 ' not in tab.get('said', 'text'))


def test_scrubbing_moves_the_robot_and_a_horizon_cuts_anew(tab):
    before = tab.get('robot measured', 'data')
    count = len(tab.get('error over time', 'data')['now'])
    tab.set('scrub', value=7.5)
    until(lambda: '7.50 s' in tab.get('clock', 'text'))
    assert tab.get('robot measured', 'data') != before
    tab.set('horizon', value=-1.0)
    until(lambda: len(tab.get('error over time', 'data')['now']) > 3 * count)


def test_the_page_needs_the_token_and_no_network(url):
    port = url.split(':')[2].split('/')[0]
    files = 'numbers.csv', 'copy.html', 'comparison.gif', 'static/js/bokeh.min.js'
    for path in ('', 'ws', *files, 'x' * 22 + '/'):
        with pytest.raises(HTTPError) as refused:
            urlopen(f'http://{HERE}:{port}/{path}', timeout=PATIENCE)
        assert refused.value.code == 404
    page = urlopen(url, timeout=PATIENCE).read().decode()
    links = Links(re.sub(r'<link[^>]*href="data:,"[^>]*>', '', page))
    token = url.split('/')[3]
    foreign = [u for u in links.urls if not u.startswith((f'/{token}/', 'static/', 'data:'))]
    assert links.scripts and foreign == []


def test_only_this_machine_can_ask(url):
    port = int(url.split(':')[2].split('/')[0])
    with socket.socket() as other:
        other.bind(('127.0.0.2', 0))
        other.settimeout(PATIENCE)
        with pytest.raises(ConnectionRefusedError):
            other.connect(('127.0.0.2', port))


def test_numbers_and_a_copy_can_be_taken_away(url):
    numbers = urlopen(f'{url}numbers.csv', timeout=PATIENCE).read().decode()
    assert numbers.startswith('what,of,at,at_unit,as_given,now,noise_floor,unit\n')
    links, text = read(urlopen(f'{url}copy.html', timeout=PATIENCE).read().decode())
    assert [u for u in links.urls if not u.startswith('data:')] == []
    assert 'noise floors' in text


def test_a_picture_and_a_film_of_the_view_can_be_taken_away(url, tab):
    tab.set('scrub', value=3.0)
    until(lambda: '3.00 s' in tab.get('clock', 'text'))
    picture = Image.open(BytesIO(urlopen(f'{url}view.png', timeout=PATIENCE).read()))
    assert picture.format == 'PNG' and picture.width > 1000
    with ThreadPoolExecutor(1) as pool:
        film = pool.submit(lambda: urlopen(f'{url}comparison.gif', timeout=PATIENCE))
        until(lambda: 'comparison.gif' in tab.get('drawing', 'text') or film.done())
        answer = film.result()
    assert answer.headers['Content-Type'] == 'image/gif'
    assert Image.open(BytesIO(answer.read())).n_frames == 101
    until(lambda: tab.get('drawing', 'text') == '')


def test_a_bag_that_is_being_recorded_is_shown_up_to_now_and_goes_on(run, tmp_path):
    whole, recorder = load(run), Recorder(tmp_path / 'growing')
    for log in whole.topics.values():
        topic = Topic(log.name, log.type, log.qos)
        for message in log.messages:
            recorder.record(topic, message.data, message.published_ns, message.log_ns)
    recorder.flush()
    words = [LEO, 'watch', tmp_path / 'growing', *MODEL]
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE}
    with subprocess.Popen(words, **pipes, text=True) as leo:
        assert Tab(json.loads(leo.stdout.readline())['url']).error
        leo.kill()
        assert leo.stderr.read().count('growing: still being recorded; read up to now') == 1
    recorder.close()
    assert len(load(tmp_path / 'growing').topics) == len(whole.topics)


def test_an_error_of_a_library_is_one_line_once_and_one_of_ours_has_its_traceback(capsys):
    (log := Logger('tornado')).addHandler(LibraryErrors())
    for garbage_to in (json.loads, json.loads, UserError):
        try:
            garbage_to(None)
        except TypeError:
            log.exception('cannot\nread it')
    assert capsys.readouterr().err.startswith('cannot\ncannot\nread it\nTraceback (most recent')


def test_a_port_in_use_is_one_line(run):
    with socket.create_server((HERE, 0)) as taken:
        port = str(taken.getsockname()[1])
        with pytest.raises(UserError, match=rf'^port {port}: .* give --port another'):
            main([str(run), *MODEL, '--port', port])


@pytest.mark.parametrize('port', ['x', '70000', '-1'])
def test_what_is_no_port_is_said(run, port):
    with pytest.raises(UserError, match=r'is no port|expected one argument'):
        main([str(run), *MODEL, '--port', port])
