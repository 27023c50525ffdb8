# SPDX-License-Identifier: Apache-2.0
"""The numbers behind leo watch, without a browser."""

import csv
from datetime import datetime, UTC
import io
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.add import patch
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.verbs.add import main as add
from leo_diffmodel.watch.page.files import numbers
from leo_diffmodel.watch.scene import Scene
from leo_diffmodel.watch.setting import Setting
from leo_diffmodel.watch.state import State
from leo_msgs_py.errors import UserError
from leo_sim.model import Model

TRUTH, LABEL = 0.2, 'coulomb_friction:pivot'
NEAR, FAR = 1.15, 3.0  # noise floors: what is as good as a perfect model, and what is not


@pytest.fixture(scope='module')
def answer(data):
    return explain([data], Model('torque_pendulum')).to_json()


@pytest.fixture
def state(scene, tmp_path):
    return State(scene, tmp_path / 'out')


def test_the_hidden_effect_brings_the_held_out_error_to_the_floor(state):
    assert state.sizes[0] == state.sizes[1] > FAR and state.sizes[2] == 1.0
    state.switch(LABEL, True)
    assert state.setting.on[LABEL]['c'] == pytest.approx(TRUTH, rel=0.15)
    assert state.sizes[1] < NEAR * state.sizes[2]
    state.finish()
    assert state.without[LABEL] == pytest.approx(state.sizes[0])
    last = state.now.rows[-1]
    assert np.all(np.array(last['rmse']) < 0.3 * np.array(state.given.rows[-1]['rmse']))


def test_the_error_as_given_is_one_number_whatever_is_switched_on(state):
    shown = [state.sizes]
    for label, name in ((LABEL, 'c'), ('viscous_friction:pivot', 'b')):
        state.switch(label, True)
        shown.append(state.sizes)
        state.move(label, name, 0.8)
        shown.append(state.sizes)
    given, now, _ = zip(*shown, strict=True)
    assert len({*given}) == 1 and now[1] < now[0] < now[2]


def test_it_begins_where_the_robots_are_seen_to_differ_most_in_the_worst_window(state):
    given, repaired, measured = state.film.frame(state.player.now)
    off = np.abs(state.film.given[..., 0] - state.film.windows.q[..., 0])
    assert given == repaired and abs(given - measured) == off[state.film.worst(0)[0], :-1].max()


def test_undo_brings_back_the_numbers_and_takes_a_drag_as_one(state):
    before = state.sizes, state.now.rows, state.film.repaired.copy()
    state.switch(LABEL, True)
    value = state.setting.on[LABEL]['c']
    for c in (0.25, 0.3, 0.35):
        state.move(LABEL, 'c', c)
    state.undo()
    assert state.setting.on[LABEL]['c'] == value
    state.undo()
    assert not state.can_undo and state.setting == Setting()
    assert (state.sizes, state.now.rows) == before[:2]
    np.testing.assert_array_equal(state.film.repaired, before[2])


def test_an_effect_switched_on_again_has_the_value_it_had(state):
    state.switch(LABEL, True)
    state.move(LABEL, 'c', 0.123)
    state.switch(LABEL, False)
    state.switch(LABEL, True)
    assert state.setting.on[LABEL]['c'] == 0.123


def test_whoever_listens_hears_of_each_change(state):
    heard = []
    state.listeners.append(lambda: heard.append(state.sizes[1]))
    state.switch(LABEL, True)
    state.look_ahead(0.25)
    state.show(1)
    state.show(1)
    assert len(heard) == 3


OTHERS = 'link_com', 'torque_ripple', 'stribeck_friction', 'velocity_lag', 'voltage_limit'


@pytest.mark.parametrize('effect', ['command_delay', *OTHERS])
def test_every_kind_of_effect_can_be_switched_on(state, effect):
    (label,) = (c for c in state.scene.candidates if c.startswith(f'{effect}:'))
    state.switch(label, True)
    assert np.isfinite(state.sizes[1]) and state.sizes[1] < 1.1 * state.sizes[0]


def test_what_explain_finds_is_switched_on_and_undone(state, answer):
    state.found(answer)
    assert state.setting.on[LABEL]['c'] == answer['effects'][0]['parameters']['c']['value']
    assert state.sizes[1] < NEAR
    (found,) = state.in_print(LABEL)
    assert found.startswith('c = 0.') and '±' in found and found.endswith('N m')
    state.move(LABEL, 'c', 0.25)
    assert state.in_print(LABEL) == ['c = 0.2500\xa0N m']
    state.undo()
    state.undo()
    assert state.setting == Setting()


def test_the_file_of_what_explain_found_is_the_one_of_leo_add(state, answer, tmp_path):
    state.found(answer)
    written = state.add()
    told = ['torque_pendulum', '--from', str(written.parent / 'explain.json')]
    assert add([*told, '-o', str(tmp_path / 'out' / 'added.yaml')]) == 0
    assert written.read_bytes() == (tmp_path / 'out' / 'added.yaml').read_bytes()
    assert json.loads((written.parent / 'explain.json').read_text())['verdict'] == 'named'


def test_the_file_of_what_is_set_by_hand_is_the_one_of_leo_add(state, tmp_path, monkeypatch):
    clock = SimpleNamespace(now=lambda zone: datetime(2026, 12, 1, 12, tzinfo=zone))
    monkeypatch.setattr(patch, 'datetime', SimpleNamespace(datetime=clock, UTC=UTC))
    state.switch(LABEL, True)
    state.switch('viscous_friction:pivot', True)
    first, second = state.add(), state.add()
    assert add(['torque_pendulum', *state.words, '-o', str(tmp_path / 'out' / 'x.yaml')]) == 0
    assert first.read_bytes() == second.read_bytes() == (tmp_path / 'out/x.yaml').read_bytes()
    assert (first.name, second.name) == ('model.yaml', 'model_2.yaml')


def test_nothing_is_written_without_a_folder_or_without_an_effect(scene, state, tmp_path):
    with pytest.raises(UserError, match='nothing is switched on'):
        state.add()
    without = State(scene)
    without.switch(LABEL, True)
    with pytest.raises(UserError, match='-o DIR'):
        without.add()
    assert list(tmp_path.iterdir()) == []


def test_refitted_constants_moved_by_hand_are_refused_by_add(state, answer):
    state.found(answer | {'constants': {'links.bob.mass': {'value': 0.7, 'unit': 'kg'}}})
    state.move(LABEL, 'c', 0.25)
    with pytest.raises(UserError, match='undo'):
        state.add()


def test_the_film_begins_anew_at_the_measured_state(state):
    state.look_ahead(0.3)
    film = state.film
    np.testing.assert_allclose(film.time[0, -1] - film.time[0, 0], 0.3)
    np.testing.assert_allclose(film.given[:, 0], film.windows.measured[:, 0])
    assert 0 < state.scene.blocks.held(film.windows).sum() < film.windows.count
    frame = film.frame(float(film.time[5, 7]))
    np.testing.assert_array_equal(frame.measured, film.windows.q[5, 7])
    np.testing.assert_array_equal(frame.given, film.given[5, 7, :1])
    errors = film.error(film.repaired, 0)
    assert errors[film.worst(0)[0]] == errors.max()


def test_the_numbers_have_units_and_are_those_that_are_shown(state):
    state.switch(LABEL, True)
    rows = list(csv.DictReader(io.StringIO(numbers(state))))
    (value,) = (r for r in rows if r['what'] == 'value')
    assert (value['of'], value['unit']) == (f'{LABEL} c', 'N m')
    ahead = [r for r in rows if r['what'] == 'held-out rms error' and r['of'] == 'pivot']
    assert [float(r['now']) for r in ahead] == [r['rmse'][0] for r in state.now.rows]
    assert all(r['unit'] for r in rows)


def test_a_bag_held_out_whole_is_what_the_error_is_given_on(data):
    scene = Scene.of([data], Model('torque_pendulum'), [record(TORQUE, seconds=6, seed=5)])
    assert set(scene.held.source) == {1} and set(scene.train.source) == {0}
    assert scene.timeline.length == pytest.approx(15.99 + 5.99)
    assert scene.timeline.words(16.5).startswith(Path('simulated_5').name)
