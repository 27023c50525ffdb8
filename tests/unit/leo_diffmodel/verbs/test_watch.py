# SPDX-License-Identifier: Apache-2.0
"""What leo watch does beside the page."""

from argparse import Namespace
import shlex
from threading import Event
from types import SimpleNamespace
import webbrowser

import pytest
from tests.patience import PATIENCE

from leo_diffmodel.explain import explanation
from leo_diffmodel.verbs import common, explain, watch, watch_common
from leo_msgs_py.errors import UserError


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


def test_the_page_hears_the_best_answer_so_far(monkeypatch):
    def explained(*given, so_far):
        given[4]('one')
        so_far(SimpleNamespace(sentence='Missing: friction.'))
        given[4]('two')
        return SimpleNamespace(to_json=dict)

    monkeypatch.setattr(explanation, 'explain', explained)
    monkeypatch.setattr(common, 'read_all', lambda *_: ([], []))
    heard = []
    assert watch_common.asked(['a_bag', '--model', 'pendulum'], heard.append) == {}
    assert heard == ['one', 'two; Missing: friction.']


@pytest.mark.parametrize('words', [['a_bag'], ['--hold-out', 'a_bag'], ['--from', '3']])
def test_a_running_robot_is_no_bag(words):
    said = rf"leo watch --live: unrecognized arguments: {' '.join(words)}; see 'leo watch --live "
    with pytest.raises(UserError, match=said):
        watch.main([*words, '--live', '--model', 'pendulum'])
