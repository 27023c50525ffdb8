# SPDX-License-Identifier: Apache-2.0
"""What buttons and taps on the page do, on a document without a server."""

from types import SimpleNamespace

from bokeh.document import Document
from bokeh.events import ButtonClick, Tap
import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.watch.finder import News
from leo_diffmodel.watch.page.document import Tab
from leo_diffmodel.watch.scene import Scene
from leo_diffmodel.watch.state import State
from leo_sim.effects import place
from leo_sim.model import Model

LABEL = 'coulomb_friction:pivot'


@pytest.fixture(scope='module')
def scene():
    effect = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    return Scene.of([record(TORQUE, effect, seconds=16)], Model('torque_pendulum'))


@pytest.fixture
def page(scene, tmp_path):
    """A document, its state, and a search that only says that it was started."""
    finder = SimpleNamespace(busy=False, news=News(), started=0)
    finder.start = lambda: vars(finder).update(busy=True, news=News('scanning', 7))
    document, state = Document(), State(scene, tmp_path / 'out')
    tab = Tab(document, state, finder, ['leo', 'add', 'torque_pendulum'])
    return SimpleNamespace(document=document, state=state, finder=finder, show=tab._refresh,
                           model=document.get_model_by_name, folder=tmp_path / 'out')


def click(page, name):
    page.document.callbacks.trigger_event(ButtonClick(page.model(name)))
    page.show()


def test_a_tap_near_a_worst_window_goes_to_its_begin_and_elsewhere_to_the_time(page):
    marks, plot = page.model('worst windows').data, page.model('time plot')
    page.document.callbacks.trigger_event(Tap(plot, x=float(marks['time'][0]) + 0.1, y=0.0))
    assert page.state.player.now == marks['begin'][0]
    page.document.callbacks.trigger_event(Tap(plot, x=0.1, y=0.0))
    assert page.state.player.now == 0.1


def test_play_undo_all_off_and_add_do_what_they_say(page):
    click(page, 'play')
    assert page.state.player.playing and page.model('play').label == 'Pause'
    assert page.model('undo').disabled and page.model('add').disabled
    page.model(f'switch {LABEL}').active = True
    page.show()
    click(page, 'add')
    assert str(page.folder / 'model.yaml') in page.model('said').text
    click(page, 'clear')
    assert page.state.setting.on == {} and not page.model(f'switch {LABEL}').active
    click(page, 'undo')
    assert page.model(f'switch {LABEL}').active


def test_the_search_is_told_while_it_goes_on_and_why_it_ended(page):
    click(page, 'find')
    assert '7: scanning' in page.model('said').text and page.model('find').disabled
    vars(page.finder).update(busy=False, news=News(error='a <bag> is gone'))
    page.show()
    assert 'a &lt;bag&gt; is gone' in page.model('said').text
    page.state.found({'verdict': 'fine', 'sentence': 'Nothing is missing.', 'effects': [],
                      'constants': {}})
    vars(page.finder).update(news=News())
    page.show()
    assert 'Nothing is missing.' in page.model('said').text and page.state.setting.on == {}


def test_effects_at_another_place_are_hidden_unless_they_are_on(page):
    page.model(f'switch {LABEL}').active = True
    page.model('place').value = 'bob'
    page.show()
    lines = {n: page.model(f'effect {n}') for n in (LABEL, 'viscous_friction:pivot')}
    roots = page.document.roots[0].references()
    parent = {n: next(r for r in roots if any(c is line for row in getattr(r, 'children', ())
                                              for c in getattr(row, 'children', ())))
              for n, line in lines.items()}  # fmt: skip
    assert [parent[n].visible for n in lines] == [True, False]
