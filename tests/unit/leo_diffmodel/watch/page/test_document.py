# SPDX-License-Identifier: Apache-2.0
"""What buttons and taps on the page do, on a document without a server."""

from types import SimpleNamespace
from unittest.mock import Mock

from bokeh.document import Document
from bokeh.events import ButtonClick, Tap
from bokeh.models import Column
import numpy as np
import pytest
from tests.page import no_run
from tests.simulate import TORQUE

from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.simulate import simulate
from leo_diffmodel.watch import missing
from leo_diffmodel.watch.next_run import Plan
from leo_diffmodel.watch.page.document import Page, Tab
from leo_diffmodel.watch.page.switches import _files
from leo_diffmodel.watch.state import State
from leo_sim.common.worker import News
from leo_sim.model import Model

LABEL = 'coulomb_friction:pivot'
FAR = 4.5  # standard errors of a bin: further off is another curve


@pytest.fixture
def page(scene, tmp_path):
    """A document, its state, and a search that only says that it was started."""
    finder = SimpleNamespace(busy=False, news=News(), started=0)
    finder.start = lambda: vars(finder).update(busy=True, news=News('scanning', 7))
    document, state = Document(), State(scene, tmp_path / 'out')
    run = no_run(hindrance='first <search>')
    run.start = lambda: vars(run).update(busy=True, news=News('running the menu', 3))
    tab = Tab(document, Page(state, finder, ['leo', 'add', 'torque_pendulum'], run))
    page = SimpleNamespace(document=document, state=state, finder=finder, run=run)
    page.folder, page.model = state.folder, document.get_model_by_name
    page.show = lambda: (tab._draw(), tab._follow())
    page.finish = lambda: (state.finish(), page.show())
    return page


def click(page, name):
    page.document.callbacks.trigger_event(ButtonClick(page.model(name)))
    page.show()


def test_a_tap_near_a_worst_window_goes_to_where_robots_differ_and_elsewhere_to_the_time(page):
    marks, plot = page.model('worst windows').data, page.model('time plot')
    page.document.callbacks.trigger_event(Tap(plot, x=float(marks['time'][0]) + 0.1, y=0.0))
    assert page.state.player.now == marks['apart'][0]
    page.document.callbacks.trigger_event(Tap(plot, x=0.1, y=0.0))
    assert page.state.player.now == 0.1


def test_a_tap_on_a_place_where_it_fails_goes_to_its_worst_window(page):
    page.finish()
    places, plot = page.model('where given').data, page.model('where given plot')
    begin = page.state.missing.given.places.rows[0]['windows'][0][0]
    assert begin in places['begin']
    number = places['begin'].index(begin)
    page.document.callbacks.trigger_event(Tap(plot, x=0.1, y=places['y'][number] + 0.3))
    assert page.state.player.now == begin
    page.document.callbacks.trigger_event(Tap(plot, x=0.1, y=-20.0))
    assert page.state.player.now == begin


def test_the_places_and_the_curve_follow_the_switches(page):
    page.finish()
    assert 'moving forward' in page.model('where given says').text
    assert np.isnan(page.model('binned torque').data['curve0']).all()
    page.state.switch(LABEL, True)
    page.show()
    assert 'computing' in page.model('where says').text
    page.finish()
    assert 'within its noise' in page.model('where now says').text
    assert 'computing' not in page.model('where says').text
    means = page.model('binned torque').data
    error = means['high'] - means['y']
    assert np.abs((means['y'] - means['curve0']) / error).max() < FAR
    before = means['curve0']
    page.state.move(LABEL, 'c', 0.4)
    page.finish()
    assert np.abs(page.model('binned torque').data['curve0']).max() > 1.7 * np.abs(before).max()


def test_another_joint_or_variable_is_shown_in_all_tabs(page):
    page.finish()
    assert page.model('against').value == '0'
    assert page.model('missing plot').xaxis.axis_label == 'pivot speed [rad/s]'
    page.model('against').value = '1'
    page.show()
    assert page.state.chosen == (0, 1)
    assert page.model('missing plot').xaxis.axis_label.startswith('pivot angle')


def test_why_there_is_no_torque_is_one_line(page, monkeypatch):
    short = Mock(side_effect=ValueError('too short'))
    monkeypatch.setattr(missing.torques, 'torque_windows', short)
    page.finish()
    for name in ('where says', 'missing says'):
        assert page.model(name).text.count('too short') == 1


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


def test_the_search_is_shown_while_it_goes_on_and_why_it_ended(page):
    click(page, 'find')
    assert '7: scanning' in page.model('said').text and page.model('find').disabled
    vars(page.finder).update(busy=False, news=News(error='a <bag> is gone'))
    page.show()
    assert 'a &lt;bag&gt; is gone' in page.model('said').text
    answer = {'verdict': 'fine', 'sentence': 'Nothing is missing.'}
    page.state.found({**answer, 'effects': [], 'constants': {}})
    vars(page.finder).update(news=News())
    page.show()
    assert 'Nothing is missing.' in page.model('said').text and page.state.setting.on == {}


def test_what_is_being_drawn_is_said_and_why_it_was_not(page):
    page.state.drawing = SimpleNamespace(busy=True, news=News('comparison.gif, picture 21'))
    page.show()
    assert 'drawing comparison.gif, picture 21' in page.model('drawing').text
    page.state.drawing = SimpleNamespace(busy=False, news=News(error='ffmpeg <failed>'))
    page.show()
    assert 'ffmpeg &lt;failed&gt;' in page.model('drawing').text


def test_a_film_is_offered_where_it_can_be_encoded(monkeypatch):
    monkeypatch.setattr('shutil.which', lambda _: '/usr/bin/ffmpeg')
    assert 'comparison.mp4' in _files()
    monkeypatch.setattr('shutil.which', lambda _: None)
    assert 'comparison.mp4' not in _files() and 'install the program ffmpeg' in _files()


def test_the_run_to_record_next_is_shown_with_its_motion_and_where_it_is(page):
    button, says = page.model('next run'), page.model('next run says')
    assert button.disabled and 'first &lt;search&gt;' in says.text
    page.run.hindrance = ''
    page.show()
    assert not button.disabled and says.text == ''
    click(page, 'next run')
    assert '3: running the menu' in says.text and button.disabled
    run = Run('steps', 'random steps', np.ones((5, 1)), np.array([True, True, False, True, True]))
    (track,) = simulate([run], Model('torque_pendulum'), 0.01)
    file = page.folder / 'next_run.csv'
    vars(page.run).update(
        busy=False,
        plan=Plan(('"steps" tells <a> from b',), TORQUE, run, track),
        file=file,
        words=['play', str(file)],
        recorded=['play', str(file), '--bag', 'new'],
    )
    page.show()
    assert '&lt;a&gt; from b' in says.text and f'leo play {file} --bag new' in says.text
    (inputs,) = page.model('next run inputs').data['us']
    assert np.isnan(inputs).any() and np.nanmax(inputs) == 1.0
    (motion,) = page.model('next run motion').data['us']
    np.testing.assert_array_equal(motion, track.episodes[0].q[:, 0])
    assert not page.model('send')


def test_effects_at_another_place_are_hidden_unless_they_are_on(page):
    page.model(f'switch {LABEL}').active = True
    page.model('place').value = 'bob'
    page.show()
    columns = [m for m in page.document.models if isinstance(m, Column)]
    for name, visible in ((LABEL, True), ('viscous_friction:pivot', False)):
        words = page.model(f'effect {name}')
        (line,) = (c for c in columns if words in getattr(c.children[0], 'children', ()))
        assert line.visible == visible
    assert all(w in page.model(f'effect {LABEL}').text for w in ('Swings shrink', 'c = 0.2'))
