# SPDX-License-Identifier: Apache-2.0
"""The buttons that send a run to the robot."""

from types import SimpleNamespace

from bokeh.document import Document
from bokeh.events import ButtonClick
import numpy as np
import pytest

from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.watch.live.commands import OPEN, Sending
from leo_diffmodel.watch.live.live import STOPPED
from leo_diffmodel.watch.next_run import Plan
from leo_diffmodel.watch.page.live import SendView
from leo_sim.description.robot import load_robot


@pytest.fixture
def page():
    run = Run('steps', 'some steps', np.zeros((40, 1)), np.ones(40, bool))
    run = SimpleNamespace(plan=Plan((), load_robot('pendulum'), run), words=['play', 'run.csv'])
    clock, sent = [0.0], []
    live = SimpleNamespace(
        robot=SimpleNamespace(condition=SimpleNamespace(e_stopped=False)),
        recording=SimpleNamespace(on=False, bag='out/run'),
        sending=Sending(now=lambda: clock[0]),
        said='',
    )
    live.send = lambda: sent.append(live.sending.question)
    document, view = Document(), SendView(run, live)
    document.add_root(view.root)
    page = SimpleNamespace(document=document, view=view, live=live, run=run)
    page.clock, page.sent = clock, sent
    return page


def widget(page, name):
    page.view.refresh()
    return page.document.get_model_by_name(name)


def click(page, name):
    page.document.callbacks.trigger_event(ButtonClick(widget(page, name)))


def test_it_is_sent_only_after_a_question_that_says_whether_it_is_recorded(page):
    assert not page.view._answers.visible and widget(page, 'send').visible
    click(page, 'send')
    assert 'will move for 2 s: &#34;steps&#34;. It is not recorded' in widget(page, 'sending').text
    page.live.recording.on = True
    assert 'recorded into out/run' in widget(page, 'sending').text
    assert page.view._answers.visible and widget(page, 'send').disabled and page.sent == []
    click(page, 'yes, move')
    (sent,) = page.sent
    assert sent.words == ('play', 'run.csv')


def test_no_and_waiting_take_the_question_back(page):
    click(page, 'send')
    click(page, 'no, do not move')
    assert not page.view._answers.visible
    click(page, 'send')
    page.clock[0] += OPEN + 0.1
    page.view.refresh()
    assert not page.view._answers.visible and page.sent == []


def test_a_stopped_robot_cannot_be_asked_and_without_a_run_there_is_no_button(page):
    page.live.robot.condition.e_stopped = True
    assert widget(page, 'send').disabled and STOPPED in widget(page, 'sending').text
    page.run.words = []
    assert not widget(page, 'send').visible and not page.view.root.visible
