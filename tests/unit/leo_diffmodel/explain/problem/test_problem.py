# SPDX-License-Identifier: Apache-2.0
"""What is asked: parameters within what the robot makes plausible, data that are the robot's."""

from dataclasses import replace

import numpy as np
import pytest
from tests.hand import led, SECONDS, shove
from tests.simulate import PENDULUM, record, TORQUE

from leo_diffmodel.compare.sizes import gravity_scale, mass_scale, reach, stall_torque
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.cut import Cut
from leo_diffmodel.explain.problem.limits import at_limit, limited
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.description.robot import load_robot
from leo_sim.effects import EFFECTS, place
from leo_sim.model import Model

ROBOTS = [PENDULUM, TORQUE, load_robot('servo_pendulum'), load_robot('leo')]


def bounded(name, low, high):
    """The first parameter of an effect of the torque pendulum within these bounds."""
    return replace(EFFECTS[name].parameters_for(TORQUE, ('pivot',))[0], low=low, high=high)


SIGNED = bounded('bias_torque', -6.0, 6.0)
POSITIVE = bounded('coulomb_friction', 0.0, 6.0)
SCALE = bounded('torque_scale', 0.2, 5.0)


def plausible(robot, **options):
    """Parameters of all candidates of a robot by effect, place and name, within their limits."""
    model = Model(robot, **options)
    return {
        (c.effect.name, c.where, p.name): p
        for c in candidates(model)
        for p in limited(c, model, SETTINGS.grids).parameters
    }


@pytest.mark.parametrize('robot', ROBOTS, ids=lambda r: r.name)
def test_limits_are_the_robots_and_never_wider_than_the_effects(robot):
    found = plausible(robot)
    joint = robot.actuators[0].joint
    torque = max(stall_torque(robot, joint), gravity_scale(robot))
    assert found['coulomb_friction', joint, 'c'].high == pytest.approx(torque)
    bias = found['bias_torque', joint, 't']
    assert (bias.low, bias.high) == pytest.approx((-torque, torque))
    link = robot.moving_links[0]
    mass = found['link_mass', link, 'm']
    own = robot.constants[f'links.{link}.mass'].value
    assert -own < mass.low < 0 < mass.high == pytest.approx(5 * mass_scale(robot))
    assert found['link_com', link, 'x'].high == pytest.approx(reach(robot))
    scale = found['torque_scale', joint, 'k']
    assert (scale.low, scale.high) == SETTINGS.grids.gain
    declared = {
        (c.effect.name, c.where, p.name): p for c in candidates(Model(robot)) for p in c.parameters
    }
    for key, p in found.items():
        given = declared[key]
        assert given.low <= p.low < p.high <= given.high, key
        assert p.neutral <= p.high and (p.low <= p.neutral or given.low == p.neutral), key
        assert p == replace(given, low=p.low, high=p.high)


def test_a_stronger_robot_may_have_more_friction():
    most = [plausible(r)['coulomb_friction', 'pivot', 'c'].high for r in ROBOTS[:3]]
    assert most[0] < most[2] < most[1]


def test_a_model_says_otherwise_at_one_place_or_all():
    own = {'coulomb_friction.c': (0.0, 0.01), 'link_mass:bob.m': (-0.02, 0.03)}
    found = plausible(TORQUE, limits=own)
    assert (found['coulomb_friction', 'pivot', 'c'].high, found['link_mass', 'bob', 'm'].high) == (
        0.01,
        0.03,
    )
    assert found['bias_torque', 'pivot', 't'] == plausible(TORQUE)['bias_torque', 'pivot', 't']


def test_an_effect_of_the_limits_keeps_its_law_and_place():
    model = Model(TORQUE)
    for c in candidates(model):
        kept = limited(c, model, SETTINGS.grids)
        assert (kept.effect, kept.where) == (c.effect, c.where)
        assert limited(kept, model, SETTINGS.grids) == kept


@pytest.mark.parametrize(
    ('parameter', 'value', 'half', 'reached'),
    [
        (SIGNED, 6.0, 0.0, True),
        (SIGNED, -6.0, 0.0, True),
        (SIGNED, 5.9, 0.2, True),
        (SIGNED, 5.9, 0.05, False),
        (SIGNED, 0.0, 0.1, False),
        (POSITIVE, 0.0, 0.1, False),
        (POSITIVE, 5.95, 0.1, True),
        (SCALE, 1.0, 0.1, False),
        (SCALE, 0.21, 0.02, True),
        (replace(SCALE, high=1.0), 1.0, 0.1, False),
        (replace(POSITIVE, high=np.inf), 6.0, 9.0, False),
    ],
)
def test_a_value_at_a_limit_is_seen_but_no_effect_is_no_limit(parameter, value, half, reached):
    assert at_limit(parameter, value, half) == reached


def test_a_shove_is_cut_out_and_said():
    model, calm = Model(TORQUE), record(TORQUE, seconds=SECONDS, seed=4)
    pushed = record(TORQUE, seconds=SECONDS, seed=3, push=shove(TORQUE, 4.0, 12.0))
    cut = Cut.of([calm, pushed], [], SETTINGS, model)
    assert [s.source for s in cut.stretches] == [1, 1] and 0 < cut.share < 0.1
    assert cut.recordings[0] is calm and len(cut.recordings[1].episodes) == 3
    for episode in cut.recordings[1].episodes:
        assert not any(np.any((episode.t > b + 0.02) & (episode.t < b + 0.13)) for b in (4, 12))
    (note,) = cut.notes
    assert note.startswith('left out as moved or held from outside, --keep uses it: ')
    assert all(f'{s.begin:.1f} to {s.end:.1f} s' in note for s in cut.stretches)


def test_what_is_held_out_is_cut_too():
    pushed = record(TORQUE, seconds=SECONDS, seed=3, push=shove(TORQUE, 4.0))
    calm = record(TORQUE, seconds=SECONDS, seed=4)
    cut = Cut.of([calm], [pushed], SETTINGS, Model(TORQUE))
    assert [s.source for s in cut.stretches] == [1] and cut.recordings == [calm]
    assert len(cut.hold_out[0].episodes) == 2
    data, held = cut.thinned
    assert [len(data), len(held)] == [1, 1]


def test_nothing_is_cut_from_a_robot_that_moved_itself():
    friction = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    data = [record(TORQUE, friction, seconds=SECONDS)]
    cut = Cut.of(data, [], SETTINGS, Model(TORQUE))
    assert cut.recordings is data and cut.notes == [] and cut.share == 0.0


@pytest.mark.parametrize('held', [False, True], ids=['motor off', 'motor against it'])
def test_no_effect_is_named_where_a_hand_did_most_of_it(held):
    answer = explain([led(PENDULUM, 3, held)], Model(PENDULUM))
    assert (answer.verdict, answer.effects, answer.hypotheses) == ('unknown', [], [])
    assert answer.sentence.startswith('Moved from outside in ')
    assert 'so no effect is named' in answer.sentence and 'pivot' in answer.sentence
    assert answer.next_run == 'record the robot alone, moved by its motors or by its weight'
    assert answer.search is None and answer.unknown is None
