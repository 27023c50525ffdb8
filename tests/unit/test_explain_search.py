# SPDX-License-Identifier: Apache-2.0
"""The search: what it may see, what counts as evidence, several effects, refitted constants."""

from dataclasses import replace

import numpy as np
import pytest
from tests.first_round import first_search
from tests.simulate import DT, PENDULUM, record, TORQUE

from leo_diffmodel.compare import noise
from leo_diffmodel.explain.decide.classes import Facts
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.imitation import imitations
from leo_diffmodel.explain.estimate.scan import Scanner
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.select.engine import scales_of, Search, settled, Trial
from leo_diffmodel.explain.select.evidence import rivals
from leo_diffmodel.explain.estimate.loss import Round
from leo_diffmodel.explain.select.review import as_one, review
from leo_diffmodel.explain.estimate.loss import away, dispersion, shows
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model_file import load_model
from leo_sim.robot import load_robot

SEEDS = range(20, 25)


@pytest.fixture(scope='module')
def friction() -> Search:
    """The first round on a torque pendulum with Coulomb friction of 0.2 N m."""
    effect = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    return first_search([record(TORQUE, effect, seconds=10)], Model(TORQUE))


@pytest.fixture(scope='module')
def clean() -> list:
    """First rounds on bags without any effect."""
    robots = (PENDULUM, TORQUE)
    return [
        first_search([record(robots[s % 2], seconds=8, seed=s)], Model(robots[s % 2])).rounds[0]
        for s in SEEDS
    ]


def test_noise_alone_stays_below_the_threshold(clean):
    for step in clean:
        assert step.best is None
        assert max(s.total for s in step.scored if s.fit) < step.threshold
        assert 8.0 <= step.threshold < 40.0


def test_what_is_left_of_clean_data_is_white(clean):
    found = [dispersion(step.null) for step in clean]
    assert 1.0 <= np.median(found) < 1.15 and max(found) < 1.5


def test_held_out_data_never_move_a_fit(friction):
    top = friction.rounds[0].scored[0].fit
    problem, start = friction.problem, friction.null.start
    held = ~problem.train
    assert 4 < held.sum() < problem.train.sum()
    q = problem.windows.q.copy()
    q[held] += np.random.default_rng(0).normal(0, 0.3, q[held].shape)
    changed = replace(problem, windows=replace(problem.windows, q=q))
    thetas = [fit(p, top.hypothesis, top.theta * 0.7, start).theta for p in (problem, changed)]
    np.testing.assert_allclose(*thetas, rtol=1e-9)


def test_two_effects_are_both_named_with_their_sizes():
    truth = [
        place(TORQUE, 'coulomb_friction', 'pivot', c=0.2),
        place(TORQUE, 'command_delay', 'pivot', delay=0.02),
    ]
    answer = explain([record(TORQUE, *truth, seconds=15)], Model(TORQUE))
    found = {e['name']: e['parameters'] for e in answer.effects}
    assert answer.verdict == 'named' and set(found) == {'coulomb_friction', 'command_delay'}
    assert found['coulomb_friction']['c']['value'] == pytest.approx(0.2, rel=0.05)
    assert found['command_delay']['delay']['value'] == pytest.approx(0.02, rel=0.05)
    rows = answer.errors['ladder']
    assert [len(rows), rows[0]['model'], rows[-1]['model']] == [4, 'as given', 'noise floor']
    assert rows[0]['rmse'][0] > rows[1]['rmse'][0] > rows[2]['rmse'][0]


def test_a_spurious_effect_is_dropped_and_a_mixture_gives_way(friction):
    candidates = {s.candidate.effect.name: s.candidate for s in friction.rounds[0].scored}
    data = record(TORQUE, place(TORQUE, 'coulomb_friction', 'pivot', c=0.2), seconds=10)
    windows = friction.problem.windows
    tried = Trial(
        list(candidates.values()), scales_of(Model(TORQUE), windows), noise.short_windows([data])
    )
    for names, theta in ((('viscous_friction', 'coulomb_friction'), [0.01, 0.18]),
                         (('stribeck_friction',), [0.15, 0.25, 0.5])):
        hypothesis = friction.null.hypothesis
        for name in names:
            hypothesis = hypothesis.with_candidate(candidates[name])
        full = fit(friction.problem, hypothesis, np.array(theta))
        found = review(friction.posed, full, {}, tried)
        assert found.changed
        assert [c.effect.name for c in found.final.hypothesis.candidates] == ['coulomb_friction']
        (step,) = found.members.values()
        assert step.best.candidate.effect.name == 'coulomb_friction'


def test_what_is_not_surely_away_from_neutral_is_not_confirmed(friction):
    best = friction.rounds[0].best
    (value,), deviation = best.fit.theta, best.fit.covariance[0, 0] ** 0.5
    (surely,) = away(best.fit, best.candidate)
    assert surely == pytest.approx(value / deviation) and surely > 3
    assert replace(best, away=surely).confirmed and shows(best.fit, best.candidate)
    near = replace(best.fit, theta=np.array([0.9 * deviation]))
    assert not replace(best, away=away(near, best.candidate)[0]).confirmed
    assert not shows(near, best.candidate)


def test_an_effect_does_not_give_way_to_the_same_thing_by_another_name():
    data = record(PENDULUM, place(PENDULUM, 'viscous_friction', 'pivot', b=3e-5), seconds=10)
    first = first_search([data], Model(PENDULUM))
    of = {s.candidate.effect.name: s.candidate for s in first.rounds[0].scored}
    pair = [of['viscous_friction'], of['back_emf_scale']]
    scales = scales_of(Model(PENDULUM), first.problem.windows)
    for mine, other in (pair, pair[::-1]):
        tried = Trial(pair, scales, noise.short_windows([data]))
        hypothesis = first.null.hypothesis.with_candidate(mine)
        full = fit(first.problem, hypothesis, np.array([hypothesis.neutral[0]]))
        found = review(first.posed, full, {}, tried)
        assert found.final.hypothesis.candidates == (mine,) and not found.changed
        assert abs(found.members[mine].of(other).score - found.members[mine].of(mine).score) < 5


def test_a_set_that_is_found_to_be_whole_is_not_reviewed_again(friction):
    of = {s.candidate.effect.name: s.candidate for s in friction.rounds[0].scored}
    data = record(TORQUE, place(TORQUE, 'coulomb_friction', 'pivot', c=0.2), seconds=10)
    trial = Trial(list(of.values()), scales_of(Model(TORQUE), friction.problem.windows),
                  noise.short_windows([data]))  # fmt: skip
    asked = []

    def tried(posed, null, full):
        asked.append([c.effect.name for c in null.hypothesis.candidates])
        return trial(posed, null, full)

    hypothesis = friction.null.hypothesis
    for name in ('viscous_friction', 'coulomb_friction'):
        hypothesis = hypothesis.with_candidate(of[name])
    full = fit(friction.problem, hypothesis, np.array([0.01, 0.18]))
    found = settled([Round(full, (), 0.0, friction.posed)], tried)
    assert [c.effect.name for c in found.final.hypothesis.candidates] == ['coulomb_friction']
    assert asked == [['coulomb_friction'], [], ['coulomb_friction']]


def test_where_much_stays_unexplained_what_was_found_first_stays():
    push = 0.25 * np.sign(np.sin(2 * np.pi * 2.7 * DT * np.arange(1000)))[:, None]
    effect = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    data = record(TORQUE, effect, seconds=10, push=push)
    first = first_search([data], Model(TORQUE))
    candidates = {s.candidate.effect.name: s.candidate for s in first.rounds[0].scored}
    tried = Trial(
        [candidates[n] for n in ('viscous_friction', 'coulomb_friction')],
        scales_of(Model(TORQUE), first.problem.windows), noise.short_windows([data]),
    )
    hypothesis = first.null.hypothesis.with_candidate(candidates['viscous_friction'])
    found = review(first.posed, fit(first.problem, hypothesis, np.array([0.05])), {}, tried)
    assert found.final.hypothesis == hypothesis and not found.changed
    ((viscous, step),) = found.members.items()
    assert step.best.candidate == candidates['coulomb_friction']
    nearest = rivals(step, Facts(TORQUE, False), step.of(viscous))[0]
    assert nearest.scored.candidate == step.best.candidate and nearest.separable_nats < 0
    both = hypothesis.with_candidate(candidates['coulomb_friction'])
    later = review(first.posed, fit(first.problem, both, np.array([0.01, 0.18])), {}, tried)
    assert later.final.hypothesis == hypothesis and not later.changed


def test_two_effects_give_way_to_one_that_does_what_both_do():
    data = record(PENDULUM, place(PENDULUM, 'back_emf_scale', 'pivot', k=1.3), seconds=10)
    first = first_search([data], Model(PENDULUM))
    of = {s.candidate.effect.name: s.candidate for s in first.rounds[0].scored}
    names = ('voltage_scale', 'torque_scale', 'back_emf_scale')
    tried = Trial([of[n] for n in names], scales_of(Model(PENDULUM), first.problem.windows),
                  noise.short_windows([data]))  # fmt: skip
    both = first.null.hypothesis.with_candidate(of['voltage_scale'])
    both = both.with_candidate(of['torque_scale'])
    full = fit(first.problem, both, np.array([1 / 1.3, 1.3]))
    found = review(first.posed, full, {}, tried)
    assert found.changed and found.final.hypothesis.candidates == (of['back_emf_scale'],)
    assert found.final.theta == pytest.approx([1.3], rel=0.05)


def test_several_effects_at_a_place_give_way_to_one_that_none_of_them_alone_leads_to():
    stribeck = {'stribeck_friction': {'c': 0.1, 'c_static': 0.25, 'v_s': 1.0}}
    pair = {'coulomb_friction': {'c': 0.1}, 'viscous_friction': {'b': 0.05}}
    names = ('coulomb_friction', 'viscous_friction')
    for truth in (stribeck, pair):
        effects = [place(TORQUE, name, 'pivot', **values) for name, values in truth.items()]
        data = record(TORQUE, *effects, seconds=10)
        first = first_search([data], Model(TORQUE))
        of = {s.candidate.effect.name: s.candidate for s in first.rounds[0].scored}
        tried = Trial(list(of.values()), scales_of(Model(TORQUE), first.problem.windows),
                      noise.short_windows([data]))  # fmt: skip
        several = first.null.hypothesis
        for name in names:
            several = several.with_candidate(of[name])
        found = as_one(first.posed, fit(first.problem, several), tried)
        if truth is pair:
            assert found is None
        else:
            assert found.best.candidate == of['stribeck_friction']


def test_what_comes_near_to_a_torque_that_was_found():
    data = record(TORQUE, place(TORQUE, 'bias_torque', 'pivot', t=0.2))
    first = first_search([data], Model(TORQUE))
    of = {s.candidate.effect.name: s.candidate for s in first.rounds[0].scored}
    scanner = Scanner(first.problem, first.null, scales_of(Model(TORQUE), first.problem.windows))
    scans = [scanner.scan(c) for c in of.values()]
    bias = first.null.hypothesis.with_candidate(of['bias_torque'])
    fitted = fit(first.problem, bias)
    (near,) = imitations(first.problem, fitted, scans)
    assert near.candidate == of['joint_spring']
    k, rest = near.theta
    angles = first.problem.windows.q
    np.testing.assert_allclose(-k * (angles - rest), fitted.theta[0], rtol=0.3)
    scaled = first.null.hypothesis.with_candidate(of['torque_scale'])
    assert imitations(first.problem, fit(first.problem, scaled), scans) == []


def test_what_a_parameter_at_its_bound_cannot_do_another_that_does_the_same_makes_up_for():
    robot = load_robot('servo_pendulum')
    low = robot.constants['sensors.pivot.offset'].uncertain[0]
    data = [record(robot, place(robot, 'encoder_offset', 'pivot', o=2 * low))]
    first = first_search(data, Model(robot))
    offset = next(s.candidate for s in first.rounds[0].scored
                  if s.candidate.effect.name == 'encoder_offset')  # fmt: skip
    hypothesis = first.null.hypothesis.with_candidate(offset)
    for own in (0.0, 1.0):
        found = fit(first.problem, hypothesis, np.r_[own, first.null.theta], first.null.start)
        assert found.theta[0] + found.theta[-1] == pytest.approx(2 * low, abs=2e-3)


@pytest.mark.parametrize('seed', [1, 2, 4])
def test_a_constant_at_its_bound_hides_no_effect(seed):
    robot = load_robot('servo_pendulum')
    low = robot.constants['sensors.pivot.offset'].uncertain[0]
    effects = [place(robot, 'encoder_offset', 'pivot', o=2 * low),
               place(robot, 'actuator_lag', 'pivot', tau=0.01)]
    answer = explain([record(robot, *effects, seconds=15, seed=seed)], Model(robot))
    assert {e['name'] for e in answer.effects} == {'encoder_offset', 'actuator_lag'}


def test_uncertain_constants_are_refitted_before_anything_is_named(tmp_path):
    path = 'actuators.pivot.torque_constant'
    model = tmp_path / 'rough.yaml'
    model.write_text(
        'robot: pendulum\nconstants:\n'
        f'  {path}: {{value: 0.045, unit: N m/A, uncertain: [0.03, 0.08]}}\n'
    )
    data = [record(PENDULUM, seconds=15, seed=3)]
    answer = explain(data, load_model(model))
    assert answer.verdict == 'fine' and answer.effects == []
    found = answer.constants[path]
    assert found['value'] == pytest.approx(0.0536, rel=0.01) and found['unit'] == 'N m/A'
    assert found['ci95'][0] < 0.0536 < found['ci95'][1]
    assert answer.model.constants[path] == found['value']
    sure = load_model('pendulum').changed(constants={path: 0.045})
    assert explain(data, sure).verdict != 'fine'


def test_whole_bags_can_be_held_out():
    effect = place(TORQUE, 'viscous_friction', 'pivot', b=0.1)
    data = [record(TORQUE, effect, seconds=8, seed=s) for s in (1, 2)]
    answer = explain(data[:1], Model(TORQUE), hold_out=data[1:])
    assert answer.verdict == 'named'
    (row,) = answer.effects
    assert row['name'] == 'viscous_friction' and row['gain_held_out'] > 20
    assert row['parameters']['b']['value'] == pytest.approx(0.1, rel=0.05)
    assert [b['path'] for b in answer.provenance['bags']] == ['simulated_1', 'simulated_2']
    other = record(TORQUE, effect, seconds=8, seed=7)
    again = explain(data[:1], Model(TORQUE), hold_out=[other])
    assert again.effects[0]['parameters']['b']['value'] == pytest.approx(
        row['parameters']['b']['value'], rel=1e-3
    )
