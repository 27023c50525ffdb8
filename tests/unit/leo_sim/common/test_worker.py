# SPDX-License-Identifier: Apache-2.0
"""Something in a process of its own."""

from functools import partial
import os
import time

from tests.patience import until

from leo_msgs_py.errors import UserError
from leo_sim.common.worker import Worker


def ask(how, report):
    report('first')
    report('second')
    if how == 'refuse':
        raise UserError('no such bag')
    if how == 'die':
        os._exit(1)
    if how == 'hang':
        time.sleep(600)
    return {'verdict': 'fine'}


def heard_of(how):
    worker = Worker()
    worker.begin(partial(ask, how))
    until(lambda: worker.poll() and worker.news.over)
    assert not worker.busy
    return worker.news


def test_its_answer_arrives():
    assert heard_of('answer').answer == {'verdict': 'fine'}


def test_what_it_refuses_and_that_it_died_are_said():
    assert heard_of('refuse').error == 'no such bag'
    assert 'ended' in heard_of('die').error


def test_it_is_stopped_whatever_it_does():
    worker = Worker()
    worker.begin(partial(ask, 'hang'))
    until(lambda: worker.poll() and worker.news.text == 'second')
    assert worker.news.count == 2 and worker.busy
    worker.stop()
    assert not worker.busy
