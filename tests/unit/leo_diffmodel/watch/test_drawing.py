# SPDX-License-Identifier: Apache-2.0
"""The view as a picture and as a film."""

from dataclasses import replace
import re
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
from PIL import Image
import pytest

from leo_diffmodel.picture import palette
from leo_diffmodel.picture.canvas import TICK
from leo_diffmodel.picture.film import RATE
from leo_diffmodel.watch import view as shown
from leo_diffmodel.watch.drawing import draw, Drawn, FILM, FINE
from leo_diffmodel.watch.state import State
from leo_diffmodel.watch.view import Stage
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

LABEL = 'coulomb_friction:pivot'


@pytest.fixture(scope='module')
def state(scene):
    state = State(scene)
    state.switch(LABEL, True)
    state.go(7.5)
    return state


@pytest.fixture
def few(state):
    return shown.view_of(state, shown.from_now(state)[::25])


def test_a_film_begins_now_and_lasts_as_long_at_any_speed(state):
    times = shown.from_now(state)
    assert times[0] == 7.5 and len(times) == shown.FILM_SECONDS * RATE + 1
    state.at_speed(0.5)
    slow = shown.from_now(state)
    state.at_speed(1.0)
    assert len(slow) == len(times) and np.ptp(slow) == pytest.approx(0.5 * np.ptp(times))


def test_where_little_is_left_a_film_shows_the_end(state):
    state.go(state.player.length)
    times = shown.from_now(state)
    state.go(7.5)
    assert times[-1] == pytest.approx(state.player.length)
    assert np.ptp(times) == pytest.approx(shown.FILM_SECONDS, abs=1.1 / RATE)


def test_a_picture_says_what_is_switched_on_and_draws_what_the_page_shows(state):
    view = shown.view_of(state, shown.now(state))
    drawn = Drawn(view, FINE)
    value = state.setting.on[LABEL]['c']
    words = [text.get_text() for text in drawn.figure.texts]
    assert f'coulomb_friction at pivot: c = {value:.4g}\xa0N m' in words
    assert any(f'→ {state.sizes[1]:.2f} noise floors' in w for w in words)
    robot, horizon, time = drawn.figure.axes
    errors = [r['rmse'][0] for r in state.now.rows]
    np.testing.assert_array_equal(horizon.lines[-1].get_ydata(), errors)
    assert horizon.lines[-1].get_color() == palette.AFTER
    marks = next(line for line in time.lines if line.get_marker() == 'v')
    assert max(marks.get_ydata()) == state.film.error(state.film.repaired, 0).max()
    assert time.lines[-1].get_xdata() == [7.5, 7.5]
    assert len(time.patches) == len(view.held['begin'])
    measured = robot.collections[2].get_segments()
    np.testing.assert_allclose(measured[0], view.stage.lines(state.film.frame(7.5).measured)[0])


def test_nothing_switched_on_is_said(state):
    state.switch(LABEL, False)
    view = shown.view_of(state, shown.now(state))
    state.switch(LABEL, True)
    assert view.switched == ('nothing is switched on',)


@pytest.mark.parametrize('name', ['view.png', 'view.svg'])
def test_a_picture_is_written(state, tmp_path, name):
    path = tmp_path / name
    assert draw(shown.view_of(state, shown.now(state)), path, lambda _: None) == name
    if path.suffix == '.svg':
        assert palette.BEFORE in path.read_text()
        ElementTree.parse(path)
    else:
        assert Image.open(path).width == 1920


def test_a_film_moves_the_robots_and_the_cursor_alone(few, tmp_path):
    told = []
    draw(few, tmp_path / 'c.gif', told.append)
    with Image.open(tmp_path / 'c.gif') as film:
        assert film.n_frames == 5 and film.info['duration'] == 1000 // RATE
        pictures = []
        for k in (0, 4):
            film.seek(k)
            pictures.append(np.asarray(film.convert('RGB'), int))
    moved = np.abs(np.diff(pictures, axis=0)[0]).max(axis=2) > 60
    columns = np.flatnonzero(moved[: 3 * len(moved) // 5].any(axis=0))
    assert columns.size and columns.max() < moved.shape[1] / 2
    assert all(size % 2 == 0 for size in moved.shape)
    assert told == ['c.gif', 'c.gif, picture 1 of 5']


def test_a_walker_stands_on_its_ground_and_is_followed(few):
    here = Model('leo').start('standing').q
    there = here + 0.5 * np.eye(len(here))[0]
    bag = SimpleNamespace(episodes=[SimpleNamespace(q=np.stack([here, there]))])
    stage = Stage(load_robot('leo'), [bag])
    view = replace(few, stage=stage, poses=np.array([[here, there, here], [there, here, there]]))
    drawn = Drawn(view, FILM, animated=True)
    robot, seen = drawn.figure.axes[0], []
    for k in range(2):
        drawn.show(k)
        ground = next(line for line in robot.lines if line.get_marker() == '|')
        assert np.ptp(ground.get_xdata()) == pytest.approx(np.ptp(robot.get_xlim()), abs=2 * TICK)
        assert robot.collections[3].get_offsets().shape[0] >= 2
        seen.append(robot.get_xlim())
    assert np.diff(seen, axis=0) == pytest.approx(0.5, abs=1e-6)
    assert re.match(r'predicted 0.5 s ahead', robot.texts[-1].get_text())
