# SPDX-License-Identifier: Apache-2.0
"""What to record next, on the page's side."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.simulate import PENDULUM

from leo_diffmodel.next_run.menu import MotionRun
from leo_diffmodel.next_run.run_file import read_run, Run
from leo_diffmodel.watch.next_run import FIRST, GONE, NextRun, NOWHERE, Plan
from leo_msgs_py.errors import UserError
from leo_sim.common.worker import News

RUN = Run('steps', 'some steps', np.linspace(-1.0, 1.0, 40)[:, None], np.ones(40, bool))


def asked(words, answer, report):
    report(f'looking at {words[0]}')
    if answer['verdict'] == 'refused':
        raise UserError('no motors')
    run = {'ambiguous': RUN, 'walker': MotionRun('stepping', 11, 20.0)}.get(answer['verdict'])
    return Plan(('in words',), PENDULUM, run)


class AtOnce(NextRun):
    def begin(self, ask):
        try:
            self.late = News(answer=ask(lambda _: None))
        except UserError as error:
            self.late = News(error=str(error))

    def poll(self):
        self.news = self.late
        return True


@pytest.fixture
def page(tmp_path):
    """The state and the search, as far as a proposal needs them; notices are counted."""
    state = SimpleNamespace(answer=None, folder=tmp_path / 'out', noticed=0)
    state.notify = lambda: vars(state).update(noticed=state.noticed + 1)
    finder = SimpleNamespace(busy=False, news=News(), words=['bag', '--model', 'pendulum'])
    return SimpleNamespace(state=state, finder=finder, next=AtOnce(state, finder, asked))


def ask(page, verdict):
    page.state.answer = SimpleNamespace(data={'verdict': verdict})
    page.next.start()
    page.next.look()
    return page.next


def test_the_search_comes_first(page):
    page.next.start()
    assert not page.next.busy and page.next.hindrance == FIRST
    page.state.answer = SimpleNamespace(data={})
    assert page.next.hindrance == ''
    page.finder.busy = True
    assert page.next.hindrance == FIRST
    page.finder.busy, page.finder.words = False, []
    assert page.next.hindrance == GONE


def test_the_run_is_written_and_can_be_played_and_a_second_one_is_another_file(page, tmp_path):
    found = ask(page, 'ambiguous')
    file = tmp_path / 'out' / 'next_run.csv'
    assert (found.file, found.words) == (file, ['play', str(file)])
    assert found.plan.words == ('in words',)
    assert found.recorded == ['play', str(file), '--bag', str(file.with_suffix(''))]
    np.testing.assert_allclose(read_run(file).inputs[:-1], RUN.inputs, atol=1e-5)
    assert page.state.noticed and found.said == ''
    assert ask(page, 'ambiguous').file == tmp_path / 'out' / 'next_run_2.csv'


def test_the_run_of_a_robot_without_a_name_says_what_predicts_it(tmp_path):
    plan = Plan((), PENDULUM, RUN, predict=('--predict', 'own'))
    assert plan.command(tmp_path / 'a.csv')[2:] == ['--predict', 'own']


def test_a_newer_answer_of_the_search_makes_the_run_an_old_one(page):
    found = ask(page, 'ambiguous')
    page.state.answer = SimpleNamespace(data={'verdict': 'fine'})
    assert found.plan is None and found.words == [] and found.said == ''


def test_a_motion_is_a_command_and_no_file(page, tmp_path):
    found = ask(page, 'walker')
    assert found.file is None
    assert found.words == ['play', 'stepping', '--seed', '11', '--seconds', '20']
    assert found.recorded[-1] == str(tmp_path / 'out' / 'stepping')


def test_where_nothing_is_open_there_is_nothing_to_play(page, tmp_path):
    found = ask(page, 'fine')
    assert found.plan.run is None and found.words == [] and found.said == ''
    assert list(tmp_path.iterdir()) == []


def test_without_a_folder_the_run_is_shown_and_not_written(page, tmp_path):
    page.state.folder = None
    found = ask(page, 'ambiguous')
    assert found.plan.run is not None and found.words == [] and found.said == NOWHERE
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_made_and_a_refusal_are_one_line(page, tmp_path):
    (tmp_path / 'out').touch()
    assert 'out' in ask(page, 'ambiguous').said
    assert ask(page, 'refused').news.error == 'no motors'
