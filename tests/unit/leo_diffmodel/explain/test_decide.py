# SPDX-License-Identifier: Apache-2.0
"""Verdicts, each with its sentence, and what keeps an effect or an answer from being sure."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.simulate import PENDULUM, record, TORQUE

from leo_diffmodel.explain.decide import (
    also_chosen,
    answer_rules,
    decide,
    effect_rules,
    instead,
    moved_rules,
    Named,
    said,
)
from leo_diffmodel.explain.estimate.fitted import Certificate, Fit, Rest, rest_of
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.findings.findings import Choices, Contender, Part, RecordingValue, Rival
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.sentence import told
from leo_diffmodel.explain.settings import SETTINGS, settings_for
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

ONE = Named('coulomb_friction:pivot', 'c = 1 N m')
OPEN = Named('coulomb_friction:pivot', 'c = 1 N m', rivals=('stribeck_friction:pivot',))
WEAK = Named('armature:pivot', 'J = 1 kg m2', doubt='chosen in 60% of the held-out turns')
POOL = {c.effect.name: c for c in candidates(Model(PENDULUM))}
CHOSEN = tuple(POOL[n] for n in ('coulomb_friction', 'bias_torque', 'torque_scale'))
LABELS = tuple(c.label for c in CHOSEN)
SURE_TWO = [Named(label, '') for label in LABELS[1:]]
WHOLE = ['this set is chosen in 70% of the held-out turns']


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE], ids=lambda r: r.name)
@pytest.mark.parametrize('engine', [{}, {'engine': 'rk4', 'integration_step': 0.0019}], ids=str)
def test_nothing_missing_is_fine(robot, engine):
    answer = explain([record(robot, seconds=12, seed=4, **engine)], Model(robot)).to_json()
    assert answer['verdict'] == 'fine' and answer['effects'] == []
    assert answer['sentence'].startswith('Nothing is missing that this data can show')
    assert answer['errors']['chi2_ratio'] == pytest.approx(1.0, abs=0.25)
    one = answer['errors']['one_step']
    np.testing.assert_allclose(one['after'], one['noise_floor'], rtol=0.4)  # few windows


def test_a_short_bag_is_untestable_and_says_what_to_record():
    answer = explain([record(TORQUE, seconds=1)], Model(TORQUE))
    assert answer.verdict == 'untestable' and answer.effects == []
    assert 'record 20 s or more' in answer.sentence
    assert answer.next_run is not None and answer.next_run.startswith('record 20 s')
    assert {'command_delay', 'link_mass'} < {row['name'] for row in answer.not_testable}
    assert all('record 20 s' in row['why'] for row in answer.not_testable)
    no_window = explain([record(TORQUE, seconds=0.06)], Model(TORQUE))
    assert no_window.verdict == 'untestable'


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE], ids=lambda r: r.name)
def test_a_still_robot_is_untestable(robot):
    data = [record(robot, seconds=20, inputs=np.zeros((2000, 1)))]
    answer = explain(data, Model(robot))
    assert answer.verdict == 'untestable'
    assert 'hardly moves' in answer.sentence
    assert answer.next_run is not None and 'swings it' in answer.next_run


def test_a_torque_periodic_in_time_is_no_known_effect():
    t = 0.01 * np.arange(1500)
    push = 0.6 * np.sin(2 * np.pi * 1.7 * t)[:, None]
    answer = explain([record(TORQUE, seconds=15, push=push)], Model(TORQUE))
    assert answer.verdict == 'unknown'
    assert 'no known effect' in answer.sentence or 'none of the known effects' in answer.sentence
    assert answer.next_run is not None and 'three times as long' in answer.next_run


def test_an_effect_in_the_model_already_is_not_missing():
    friction = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    data = [record(TORQUE, friction, seconds=10)]
    assert explain(data, Model(TORQUE, [friction])).verdict == 'fine'


def test_a_weak_spring_with_a_far_rest_leaves_a_constant_torque_its_name():
    bias = place(TORQUE, 'bias_torque', 'pivot', t=0.22)
    answer = explain([record(TORQUE, bias, seconds=10, seed=6)], Model(TORQUE))
    (effect,) = answer.effects
    assert (answer.verdict, effect['name']) == ('named', 'bias_torque')
    spring = [r for r in effect['confusable_with'] if r['name'] == 'joint_spring']
    assert all(r['separable_nats'] > SETTINGS.gates.margin_nats for r in spring)


@pytest.mark.parametrize(
    ('named', 'ratio', 'share', 'verdict', 'more'),
    [
        ([], 1.0, 0.0, 'fine', {}),
        ([], 3.0, 1.0, 'unknown', {}),
        ([ONE], 1.1, 0.01, 'named', {}),
        ([ONE], 3.0, 0.01, 'named', {}),
        ([ONE], 3.0, 0.6, 'partly', {}),
        ([ONE], 1.0, 0.0, 'partly', {'more': True}),
        ([OPEN], 1.1, 0.01, 'ambiguous', {}),
        ([WEAK], 1.1, 0.01, 'ambiguous', {}),
        ([ONE, WEAK], 3.0, 0.6, 'partly', {}),
        ([ONE, WEAK], 1.0, 0.0, 'ambiguous', {'doubts': WHOLE}),
        ([OPEN], 3.0, 0.6, 'unknown', {}),
        ([ONE], 1.1, 0.01, 'ambiguous', {'doubts': WHOLE}),
        ([], 1.1, 0.01, 'fine', {'doubts': WHOLE}),
        ([], 1.0, 0.0, 'unknown', {'unknown': True}),
        ([ONE], 1.0, 0.0, 'partly', {'unknown': True}),
        ([ONE, WEAK], 1.0, 0.0, 'partly', {'unknown': True}),
        ([OPEN], 1.0, 0.0, 'unknown', {'unknown': True}),
        ([], 1.0, 0.0, 'ambiguous', {'cut_short': True}),
        ([ONE], 1.0, 0.0, 'ambiguous', {'cut_short': True}),
        ([], 40.0, 0.9, 'ambiguous', {'cut_short': True}),
        ([ONE], 40.0, 0.9, 'ambiguous', {'cut_short': True}),
    ],
)
def test_how_a_verdict_is_reached(named, ratio, share, verdict, more):
    rest = Rest(SETTINGS.gates, ratio, share)
    reached, rules = decide(named, rest, **{'unknown': False, **more})
    assert reached == verdict and rules[-1].name.startswith(verdict)
    assert [rule.fired for rule in rules] == [False] * (len(rules) - 1) + [True]


def test_what_is_not_sure_stands_beside_what_is():
    words = told('partly', [ONE, WEAK], 'error 2 -> 1 rad', rest='60 % is something else')
    assert [thing.name for thing in words.things] == [ONE.label]
    assert words.more[0] == (
        'Beside them, not sure: armature:pivot (J = 1 kg m2), chosen in 60% of the held-out turns.'
    )


@pytest.mark.parametrize('verdict', ['named', 'partly', 'ambiguous'])
def test_what_is_named_is_said_with_its_doubt_and_the_error(verdict):
    for named in ([ONE], [OPEN], [ONE, WEAK]):
        words = str(told(verdict, named, 'error 2 -> 1 rad', rest='60 % is something else'))
        assert 'error 2 -> 1 rad' in words
        assert all(n.label in words and n.doubt in words for n in named)
        assert '60 % is something else' in words
    assert WHOLE[0] in told(verdict, [ONE], 'error 2 -> 1 rad', WHOLE).notes


@pytest.mark.parametrize('named', [[], [ONE], [OPEN]], ids=['nothing', 'one', 'open'])
def test_a_law_that_is_no_known_effect_is_said(named):
    for verdict in ('unknown', 'partly') if named else ('unknown',):
        words = told(verdict, named, 'error 2 -> 1 rad', unknown='a torque of time')
        assert str(words).endswith(': a torque of time.')


def test_what_is_far_above_the_noise_matters_however_much_was_explained():
    assert Rest(SETTINGS.gates, 14.7, 0.07).matters
    assert not Rest(SETTINGS.gates, 2.0, 0.07).matters


@pytest.mark.parametrize(
    ('on_ground', 'acting', 'steady', 'matters'),
    [
        (True, 20, 100, True),
        (True, 10, 100, False),
        (True, 40, 60, False),
        (True, 95, 5, True),
        (False, 20, 100, False),
        (False, 60, 100, True),
    ],
)
def test_on_the_ground_what_acts_in_some_steady_windows_matters(
    on_ground, acting, steady, matters
):
    residual = np.random.default_rng(0).standard_normal((100, 198))
    residual[:acting] *= 3.0
    none, hypothesis = np.zeros((100, 0)), Hypothesis()
    left = Fit(hypothesis, none, none, none, np.zeros((100, 18)), none, residual, none)
    settings = settings_for(load_robot('leo')) if on_ground else SETTINGS
    problem = SimpleNamespace(
        gates=settings.gates,
        numerics=settings.numerics,
        steady=lambda *_: np.arange(100) >= 100 - steady,
    )
    rest = rest_of(problem, left, left)
    assert rest.matters == matters
    assert matters or rest.ratio == pytest.approx(1.0, abs=0.2)


def fitted(names, by=0.1):
    """A fit of effects, each so far from neutral and known to 0.001."""
    hypothesis, none = Hypothesis(tuple(names)), np.zeros((0, 0))
    theta = hypothesis.neutral + by
    known = np.zeros((len(theta), 2))
    return Fit(hypothesis, theta, 1e-6 * np.eye(len(theta)), known, none, none, none, none)


def less(one, by=0.1):
    return fitted([c for c in CHOSEN if c != one], by)


def findings(share=1.0, floors=(), by_recording=({}, {}, {}), **of_choices):
    """Three effects a little away from neutral, each in this share of the resamples."""
    fit = fitted(CHOSEN)
    parts = tuple(Part(c, fit, less(c), (9.0, 9.0), {}, {}, share, ()) for c in CHOSEN)
    holds = (frozenset(LABELS),) * 10
    choices = {'holds': holds, 'sets': ((LABELS, share),), 'instead': (), 'more': ()}
    return SimpleNamespace(
        gates=SETTINGS.gates,
        numerics=SETTINGS.numerics,
        final=fit,
        effects=parts,
        floors=floors,
        by_recording=by_recording,
        choices=Choices(**choices | of_choices),
        others=(),
        refuting=(),
        search=SimpleNamespace(untried=()),
        unknown=None,
    )


def doubts(made, part=None):
    """What is said against an effect, or against the whole answer."""
    named = [Named(label, '') for label in LABELS]
    return [*said(effect_rules(made, part) if part else answer_rules(made, named))]


def test_what_all_resamples_hold_is_sure():
    made = findings()
    assert not any(doubts(made, part) for part in made.effects) and not doubts(made)
    rules = [*effect_rules(made, made.effects[0])]
    assert [rule.number for rule in rules[:3]] == pytest.approx([0.1, 0.1, 1.0], abs=0.01)
    assert {rule.about for rule in rules} == {LABELS[0]} and rules[2].limit == 0.9


@pytest.mark.parametrize(('moved', 'sure'), [(0.001, True), (0.02, False)])
def test_what_a_law_beside_it_moves_out_of_its_interval_is_not_sure(moved, sure):
    made = findings()
    beside = replace(made.final, theta=made.final.theta + moved)
    made.unknown = SimpleNamespace(fit=beside)
    told = doubts(made, made.effects[0])
    assert told == ([] if sure else ['whose value is another beside the unknown law'])


def test_a_value_at_its_limit_is_not_sure():
    made = findings()
    part = made.effects[0]
    (parameter,) = part.candidate.parameters
    narrow = replace(part.candidate, parameters=(replace(parameter, high=0.1),))
    fit = replace(part.fit, hypothesis=Hypothesis((narrow, *CHOSEN[1:])))
    told = doubts(made, replace(part, candidate=narrow, fit=fit))
    assert told == ['at the limit of what is plausible']


def test_an_interval_that_holds_no_effect_is_not_sure():
    made = findings()
    part = made.effects[0]
    wide = replace(part.fit, covariance=100.0 * np.eye(len(part.fit.theta)))
    assert doubts(made, replace(part, fit=wide)) == ['whose interval holds no effect']


@pytest.mark.parametrize(('value', 'said'), [(0.7, []), (1.0, ['mass runs onto its limit 1 kg'])])
def test_a_constant_at_the_end_of_its_range_is_said(value, said):
    made = findings()
    mass = SimpleNamespace(label='mass', unit='kg')
    ranges = {'low': np.array([0.5]), 'high': np.array([1.0])}
    hypothesis = SimpleNamespace(constants=(mass,), first_constant=0, **ranges)
    made.final = SimpleNamespace(theta=np.array([value]), hypothesis=hypothesis, certificate=None)
    assert doubts(made) == said


def test_what_too_few_resamples_hold_is_not_and_what_they_choose_instead_is_said():
    others = (('armature:pivot', 0.3), ('velocity_lag:pivot', 0.04))
    holds = (frozenset(LABELS),) * 7 + (frozenset(LABELS[1:]),) * 3
    made = findings(0.7, instead=others, holds=holds)
    assert doubts(made, made.effects[0]) == ['chosen in 70% of the held-out turns']
    assert doubts(made) == ['this set is chosen in 70% of the held-out turns']
    (rule,) = [r for r in answer_rules(made, [WEAK, *SURE_TWO]) if r.name.startswith('set chosen')]
    assert rule.number == 1.0 and not rule.fired
    assert instead(made, made.effects[0]) == ['armature:pivot']
    sure = findings(instead=others)
    assert instead(sure, sure.effects[0]) == []


def test_more_in_too_many_resamples_is_said():
    more = (('armature:pivot', 0.3), ('velocity_lag:pivot', 0.04))
    words = 'the held-out turns choose armature:pivot in 30%, velocity_lag:pivot in 4%'
    assert also_chosen(findings(sets=((LABELS, 0.66),), more=more)) == f'beside them {words}'
    assert also_chosen(findings(sets=((LABELS, 0.95),), more=more)) == ''
    assert also_chosen(findings(sets=(((), 0.66),), more=more)) == ''


def test_effects_below_the_noise_floor_are_small():
    made = findings(floors=(22.0, 1.1, 0.3))
    assert [bool(doubts(made, part)) for part in made.effects] == [False, False, True]


@pytest.mark.parametrize(('other', 'agree'), [(0.11, True), (0.25, False)])
def test_recordings_that_exclude_each_other_disagree(other, agree):
    first = Hypothesis(CHOSEN).offset(1)
    values = {first: [RecordingValue('run_1', 0.1, 0.001), RecordingValue('run_2', other, 0.001)]}
    made = findings(by_recording=({}, values, {}))
    told = doubts(made)
    assert bool(told) is not agree
    assert all('bias_torque:pivot: t is 0.1 in run_1 and 0.25 in run_2' in each for each in told)
    others = [Named(label, '') for label in (LABELS[0], LABELS[2])]
    assert not [*said(answer_rules(made, others))]


def test_what_there_was_no_time_for_is_said():
    made = findings()
    made.search.untried = ('a:pivot', 'b:pivot', 'c:pivot', 'd:pivot', 'e:pivot')
    assert doubts(made) == ['the time was over; not tried: a:pivot, b:pivot, c:pivot and 2 more']


@pytest.mark.parametrize(
    ('starts', 'said'),
    [(1, 'the fit has not come to its end'), (4, '4 starts of the fit end at different values')],
)
def test_what_has_not_converged_is_never_sure(starts, said):
    made = findings()
    made.final = replace(made.final, certificate=Certificate(3.0, starts, 1, False))
    assert doubts(made) == [said]


def test_sets_that_speak_against_the_choice_are_said():
    made = findings()
    made.others = (Contender('armature:pivot', 30.0, LABELS),)
    made.refuting = (Contender('x:pivot', 0.2, LABELS[:1]),)
    leaves_less = 'armature:pivot would leave less unexplained'
    assert doubts(made) == [leaves_less, 'x:pivot has a smaller held-out error']
    # it has what is sure as well; the next one has not
    assert [*said(answer_rules(made, [WEAK, *SURE_TWO]))] == [leaves_less]
    made.refuting += (Contender('y:pivot', 0.1, LABELS[1:]),)
    both = [leaves_less, 'y:pivot has a smaller held-out error']
    assert [*said(answer_rules(made, [WEAK, *SURE_TWO]))] == both


@pytest.mark.parametrize(('by', 'sure'), [(0.1, True), (0.12, False)])
def test_what_is_sure_has_the_same_value_without_what_is_not(by, sure):
    made = findings(floors=(22.0, 1.1, 0.3))
    weak = replace(made.effects[2], without=less(CHOSEN[2], by))
    rules = [*moved_rules(made, made.effects[0], [weak])]
    assert [rule.fired for rule in rules] == [not sure]
    rival = Rival(POOL['armature'], fitted([*CHOSEN[:2], POOL['armature']], by), 1.0, None)
    near = replace(made.effects[2], rivals=(rival,))
    told = [*said(moved_rules(made, made.effects[0], [near]))]
    assert told == ([] if sure else ['whose value is another beside armature:pivot'])
