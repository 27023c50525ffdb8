# SPDX-License-Identifier: Apache-2.0
"""What is asked is of the robot: what something else did is cut out, and said."""

import numpy as np
import pytest
from tests.hand import led, SECONDS, shove
from tests.simulate import PENDULUM, record, steps, TORQUE

from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.usable import Cut
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.effects import place
from leo_sim.model import Model


def test_a_shove_is_cut_out_and_said():
    model, calm = Model(TORQUE), record(TORQUE, seconds=SECONDS, seed=4)
    pushed = record(TORQUE, seconds=SECONDS, seed=3, push=shove(TORQUE, 4.0, 12.0))
    cut = Cut.of([calm, pushed], [], SETTINGS, model)
    assert [len(found) for found in cut.stretches] == [0, 2] and 0 < cut.share < 0.1
    assert not cut.mostly
    assert cut.recordings[0] is calm and len(cut.recordings[1].episodes) == 3
    for episode in cut.recordings[1].episodes:
        assert not any(np.any((episode.t > b + 0.02) & (episode.t < b + 0.13)) for b in (4, 12))
    (note,) = cut.notes
    assert note.startswith('left out as moved or held from outside, --keep uses it: ')
    spans = [span for f in cut.stretches[1] for span in f.where]
    assert all(f'{begin:.1f} to {end:.1f} s' in note for begin, end in spans)


def test_what_is_held_out_is_cut_too():
    pushed = record(TORQUE, seconds=SECONDS, seed=3, push=shove(TORQUE, 4.0))
    calm = record(TORQUE, seconds=SECONDS, seed=4)
    cut = Cut.of([calm], [pushed], SETTINGS, Model(TORQUE))
    assert [len(found) for found in cut.stretches] == [0, 1] and cut.recordings == [calm]
    assert len(cut.hold_out[0].episodes) == 2
    data, held = cut.thinned
    assert [len(data), len(held)] == [1, 1]


def test_nothing_is_cut_from_a_robot_that_moved_itself():
    friction = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    data = [record(TORQUE, friction, seconds=SECONDS)]
    cut = Cut.of(data, [], SETTINGS, Model(TORQUE))
    assert cut.recordings is data and cut.notes == [] and cut.share == 0.0


def test_what_a_known_effect_explains_down_to_the_noise_was_no_hand():
    """After many turns an angle that is 2 % off says nothing of where the weight pulls."""
    inputs = 2.0 * steps(TORQUE, SECONDS, 1)
    scaled = place(TORQUE, 'encoder_scale', 'pivot', k=0.98)
    data = [record(TORQUE, scaled, seconds=SECONDS, inputs=inputs)]
    cut = Cut.of(data, [], SETTINGS, Model(TORQUE))
    assert cut.mostly and cut.recordings == [] and cut.notes
    answer = explain(data, Model(TORQUE))
    assert 'left out' not in answer.sentence
    assert [e['name'] for e in answer.effects] == ['encoder_scale']
    assert answer.effects[0]['parameters']['k']['value'] == pytest.approx(0.98, abs=1e-3)


def test_a_search_that_was_cut_short_accuses_no_hand():
    answer = explain([led(PENDULUM, 3)], Model(PENDULUM), within=0.0)
    assert answer.sentence.startswith('Cut short, so nothing is sure')


def test_no_effect_is_named_where_a_hand_did_most_of_it():
    answer = explain([led(PENDULUM, 3)], Model(PENDULUM))
    assert (answer.verdict, answer.effects, answer.hypotheses) == ('unknown', [], [])
    assert answer.sentence.startswith('Moved from outside in ')
    assert 'so no effect is named' in answer.sentence and 'pivot' in answer.sentence
    assert answer.next_run == 'record the robot alone, moved by its motors or by its weight'
    assert answer.search is None and answer.unknown is None
