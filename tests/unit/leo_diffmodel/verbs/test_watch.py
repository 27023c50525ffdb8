# SPDX-License-Identifier: Apache-2.0
"""What leo watch does beside the page."""

from argparse import Namespace
import shlex
from threading import Event
import webbrowser

from tests.patience import PATIENCE

from leo_diffmodel.verbs import common, explain, watch_common


def test_a_browser_that_returns_when_it_is_closed_does_not_hold_the_page_up(monkeypatch):
    opened, closed = Event(), Event()
    monkeypatch.setattr(webbrowser, 'open', lambda _: opened.set() or closed.wait(PATIENCE))
    monkeypatch.setenv('DISPLAY', ':0')
    watch_common.say(Namespace(json=False, no_browser=False), 'http://localhost/', 1)
    assert opened.wait(PATIENCE) and not closed.is_set()
    closed.set()


def test_other_verbs_name_the_command_of_the_page_on_the_same_data():
    words = ['a run', 'b', '--hold-out', 'c', 'd e', '--model', 'pendulum', '--from', '3']
    typed = common.watch(explain._parser().parse_args([*words, '--step', '0.05']))
    assert typed == (
        "leo watch 'a run' b --model pendulum --from 3 --hold-out c 'd e' --step 0.05"
    )
    again = watch_common.parser().parse_args(shlex.split(typed)[2:])
    assert (again.bags, again.hold_out, again.begin) == (['a run', 'b'], ['c', 'd e'], 3.0)
