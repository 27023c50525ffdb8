# SPDX-License-Identifier: Apache-2.0
"""Names of a robot, its joints and bags are words on the page, in its copy and its pictures."""

from copy import copy as copied
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

from bokeh.document import Document
from bokeh.embed import file_html
from bokeh.models import Div
import pytest
from tests.hostile_names import check_html, folder_of, HTML
from tests.page import no_run
from tests.simulate import record

from leo_diffmodel.watch.drawing import draw
from leo_diffmodel.watch.page.document import Page, Tab
from leo_diffmodel.watch.page.files import copy
from leo_diffmodel.watch.page.next_run import joints_legend
from leo_diffmodel.watch.scene import Scene
from leo_diffmodel.watch.state import State
from leo_diffmodel.watch.view import now, view_of
from leo_sim.common.worker import News
from leo_sim.effects import get_effect, place
from leo_sim.model import Model


@pytest.fixture(scope='module')
def state(tmp_path_factory):
    folder = folder_of(tmp_path_factory.mktemp('sent') / 'robot', f'pivot{HTML}', f'arm{HTML}')
    model = Model(str(folder))
    joint = model.robot.joint_names[0]
    friction = place(model.robot, 'coulomb_friction', joint, c=0.2)
    recording = record(model.robot, friction, seconds=16)
    effect = copied(get_effect('viscous_friction'))
    effect.name, effect.equation, effect.looks_like = 'mine', HTML, HTML
    recordings = [replace(recording, path=Path(HTML.replace('/', '')))]
    state = State(Scene.of(recordings, model, extra=[effect]))
    state.switch(f'coulomb_friction:{joint}', True)
    state.finish()
    return state


def words_of(state: State, finder: SimpleNamespace) -> Document:
    """The page, and what is said on it, checked."""
    document = Document()
    tab = Tab(document, Page(state, finder, ['leo', 'add', HTML], no_run(hindrance=HTML)))
    tab._draw()
    tab._follow()
    said = [*document.select({'type': Div})]
    assert sum('&lt;evil' in div.text for div in said) >= 5
    (mine,) = (div for div in said if (div.name or '').startswith('effect mine'))
    assert mine.text.count('&lt;evil') == 3 * HTML.count('<evil')
    assert all(div.disable_math for div in said)
    for div in said:
        check_html(div.text)
    return document


@pytest.mark.parametrize('news', [{}, {'error': HTML}, {'text': HTML, 'busy': True}])
def test_no_name_is_html_on_the_page(state, news):
    busy = news.pop('busy', False)
    words_of(state, SimpleNamespace(busy=busy, news=replace(News(), **news)))


def test_what_is_lacking_and_the_legend_say_names(state):
    check_html(joints_legend((HTML, HTML)))
    state.missing.trouble, before = HTML, state.missing.trouble
    words_of(state, SimpleNamespace(busy=False, news=News()))
    state.missing.trouble = before


def test_the_page_itself_and_its_copy_are_what_they_are_with_any_name(state):
    document = words_of(state, SimpleNamespace(busy=False, news=News()))
    page = file_html(document, template=document.template, title=document.title)
    check_html(page)
    check_html(copy(state))


def test_a_picture_is_xml_and_takes_no_name_for_a_formula(state, tmp_path):
    file = tmp_path / 'view.svg'
    draw(view_of(state, now(state)), file, lambda _: None)
    tags = {element.tag for element in ElementTree.parse(file).iter()}
    assert not any('evil' in str(tag) for tag in tags)
