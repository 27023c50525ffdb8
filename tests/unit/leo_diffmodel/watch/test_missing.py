# SPDX-License-Identifier: Apache-2.0
"""The torque that both models lack, computed in pieces."""

from unittest.mock import Mock

import numpy as np
import pytest
from tests.ground import LEO, recorded

from leo_diffmodel.compare.noise import HISTORY
from leo_diffmodel.compare.torque import estimate, in_parts, torque_windows
from leo_diffmodel.compare.where import ranked, stands_out, worst_places
from leo_diffmodel.watch import missing
from leo_diffmodel.watch.scene import Scene
from leo_diffmodel.watch.state import State
from leo_sim.effects import place
from leo_sim.model import Model

LABEL = 'coulomb_friction:pivot'


def whole(pieces):
    """What a generator returns, and how often it paused."""
    pauses = 0
    while True:
        try:
            next(pieces)
            pauses += 1
        except StopIteration as end:
            return end.value, pauses


def test_in_parts_is_the_same_as_at_once(scene):
    windows = torque_windows(scene.recordings, scene.model, HISTORY)
    at_once = estimate(scene.model, windows, scene.sigma)
    parts, pauses = whole(in_parts(lambda w: estimate(scene.model, w, scene.sigma), windows, 50))
    assert pauses == -(-windows.count // 50)
    np.testing.assert_allclose(parts.torque, at_once.torque, rtol=1e-9)
    np.testing.assert_array_equal(parts.time, at_once.time)
    assert parts.windows is windows and parts.carrying is None


def test_the_curve_of_what_is_missing_is_what_is_missing(scene):
    state = State(scene)
    state.switch(LABEL, True)
    state.move(LABEL, 'c', 0.2)
    state.finish()
    both = state.missing
    missing = both.given.torque
    noise, off = np.sqrt((missing.spread**2).mean()), missing.torque - both.curve
    assert np.std(off) == pytest.approx(noise, rel=0.15)
    assert np.std(missing.torque) > 1.4 * noise
    assert not both.given.places.noise_only and both.now.places.noise_only


def test_a_change_drops_what_was_not_computed_of_the_one_before(scene):
    state = State(scene)
    state.switch(LABEL, True)
    assert state.go_on()
    state.switch(LABEL, False)
    state.finish()
    assert state.missing.now is state.missing.given and state.missing.curve is None
    assert not state.go_on() and not state.missing.behind


def test_what_cannot_be_told_is_said_in_one_line(scene, monkeypatch):
    singular = Mock(side_effect=np.linalg.LinAlgError('Singular matrix'))
    monkeypatch.setattr(missing.torques, 'torque_windows', singular)
    state = State(scene)
    state.finish()
    assert 'Singular matrix' in state.missing.trouble and state.missing.given is None
    state.switch(LABEL, True)
    assert state.sizes[1] < state.sizes[0]


def test_places_that_stand_out_come_first(scene):
    state = State(scene)
    state.finish()
    rows = state.missing.given.places.rows
    found = ranked(rows)
    assert len({(r['joint'], r['variable']) for r in found}) == len(found)
    out = [stands_out(r) for r in found]
    assert out == sorted(out, reverse=True) and found[: sum(out)] == worst_places(rows)


def test_a_robot_on_the_ground_takes_several_pieces():
    bag = recorded(place(LEO, 'coulomb_friction', 'left_knee', c=0.3), seconds=4)
    state = State(Scene.of([bag], Model('leo', scheme='training')))
    pieces = 0
    while state.go_on():
        pieces += 1
    assert pieces > 4
    most = max(state.missing.given.places.joints, key=lambda r: r['share'])
    assert most['joint'] == 'left_knee'
