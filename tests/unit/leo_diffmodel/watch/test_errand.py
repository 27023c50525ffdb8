# SPDX-License-Identifier: Apache-2.0
"""Something in a process of its own."""

from functools import partial
import os
import time

from tests.patience import until

from leo_diffmodel.watch.errand import Errand
from leo_msgs_py.errors import UserError


def ask(how, heard):
    heard('first')
    heard('second')
    if how == 'refuse':
        raise UserError('no such bag')
    if how == 'die':
        os._exit(1)
    if how == 'hang':
        time.sleep(600)
    return {'verdict': 'fine'}


def heard_of(how):
    errand = Errand()
    errand.begin(partial(ask, how))
    until(lambda: errand.hear() and errand.news.over)
    assert not errand.busy
    return errand.news


def test_its_answer_arrives():
    assert heard_of('answer').answer == {'verdict': 'fine'}


def test_what_it_refuses_and_that_it_died_are_said():
    assert heard_of('refuse').error == 'no such bag'
    assert 'ended' in heard_of('die').error


def test_it_is_stopped_whatever_it_does():
    errand = Errand()
    errand.begin(partial(ask, 'hang'))
    until(lambda: errand.hear() and errand.news.text == 'second')
    assert errand.news.count == 2 and errand.busy
    errand.stop()
    assert not errand.busy
