# SPDX-License-Identifier: Apache-2.0
"""A search over what a robot measured last."""

from pathlib import Path

import pytest
from tests.patience import until
from tests.unit.leo_diffmodel.watch.live.test_buffer import say

from leo_diffmodel.watch.live.buffer import MessageBuffer
from leo_diffmodel.watch.live.live import LiveFinder


def asked(words, heard):
    return {'words': words, 'there': Path(words[0]).is_dir()}


@pytest.fixture
def buffer():
    buffer = MessageBuffer(2.0)
    for k in range(50):
        say(buffer, k)
    return buffer


def answer(finder):
    finder.start()
    until(lambda: finder.poll() and finder.news.over)
    return finder.news.answer


def test_what_is_searched_stays_where_a_folder_is_given(buffer, tmp_path):
    found = answer(LiveFinder(buffer, asked, ['--model', 'x'], tmp_path / 'out'))
    assert found == {'words': [f'{tmp_path}/out/searched', '--model', 'x'], 'there': True}
    assert (tmp_path / 'out' / 'searched' / 'metadata.yaml').is_file()


def test_without_a_folder_it_is_there_only_for_the_search(buffer):
    found = answer(LiveFinder(buffer, asked, [], None))
    assert found['there'] and not Path(found['words'][0]).parent.exists()


def test_a_bag_that_cannot_be_saved_is_said(buffer, tmp_path):
    (tmp_path / 'out').touch()
    finder = LiveFinder(buffer, asked, [], tmp_path / 'out')
    finder.start()
    assert 'out' in finder.news.error and not finder.busy
