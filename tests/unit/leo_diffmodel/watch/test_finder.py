# SPDX-License-Identifier: Apache-2.0
"""The search in a process of its own."""

from functools import partial
import os
import time

from leo_diffmodel.watch.finder import Finder
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
    finder, texts = Finder(partial(ask, how)), []
    finder.start()
    end = time.monotonic() + 120
    while not finder.news.over and time.monotonic() < end:
        if finder.hear():
            texts.append(finder.news.text)
        time.sleep(0.02)
    assert not finder.busy
    return finder.news


def test_its_answer_arrives():
    assert heard_of('answer').answer == {'verdict': 'fine'}


def test_what_it_refuses_and_that_it_died_are_said():
    assert heard_of('refuse').error == 'no such bag'
    assert 'ended' in heard_of('die').error


def test_it_is_stopped_whatever_it_does():
    finder = Finder(partial(ask, 'hang'))
    finder.start()
    end = time.monotonic() + 120
    while finder.news.text != 'second' and time.monotonic() < end:
        finder.hear()
        time.sleep(0.02)
    assert finder.news.count == 2 and finder.busy
    finder.stop()
    assert not finder.busy
