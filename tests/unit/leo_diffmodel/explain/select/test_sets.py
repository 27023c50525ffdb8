# SPDX-License-Identifier: Apache-2.0
"""The set that is chosen: the smallest that no larger one beats, whatever the order."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from tests.linear import POOL, posed, Regression, scored, wide

from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import compatible, Hypothesis, widens
from leo_diffmodel.explain.select.evidence import Weight
from leo_diffmodel.explain.select.neighbours import searched
from leo_diffmodel.explain.select.sets import chosen, Sets
from leo_diffmodel.explain.select.stable import canonical, long_horizon_tie_break, resamples
from leo_diffmodel.explain.settings import SETTINGS
from leo_msgs_py.console import Reporter
from leo_sim.model import Model

PLAIN = Weight(spread=1.0, samples=1000.0, most=np.inf, gates=SETTINGS.gates)
FOLD = np.repeat(np.arange(10), 4)
LIMIT = 12.0
QUIET = Reporter.of(lambda _: None)
NAMES = ('armature', 'bias_torque', 'coulomb_friction', 'torque_scale', 'viscous_friction')
BETWEEN = {c.label: c for c in candidates(Model('double_pendulum'))}


def left(**by_names: float) -> list:
    """Sets with what each leaves in all windows together: a_b=3 is that of a and b."""
    long = {'a': 'armature', 'b': 'bias_torque', 'c': 'coulomb_friction', 'none': None}
    return [
        scored(
            [long[n] for n in names.split('_') if long[n]],
            np.full(len(FOLD), total / len(FOLD)),
            FOLD,
        )
        for names, total in by_names.items()
    ]


def names(best) -> set:
    return {c.effect.name for c in best.names}


@pytest.mark.parametrize(
    ('sets', 'right'),
    [
        (left(none=800, a=790), set()),
        (left(none=800, a=700), {'armature'}),
        (left(none=800, a=400, b=500, a_b=395), {'armature'}),
        (left(none=800, a=400, b=500, a_b=340), {'armature', 'bias_torque'}),
        (left(none=800, a=799, b=799, a_b=400), {'armature', 'bias_torque'}),
        (left(none=800, a_b=400), set()),
    ],
    ids=['nothing', 'one', 'a trifle more', 'both', 'only together', 'parts unknown'],
)
def test_the_smallest_set_is_chosen_that_no_larger_one_beats(sets, right):
    for order in permutations(sets):
        assert names(chosen(order, PLAIN, LIMIT)) == right


def test_fewer_effects_of_more_parameters_are_no_simpler_answer():
    none, one, *others = left(none=800, c=400, a=600, b=600, a_b=392)
    assert names(chosen([none, one, *others], PLAIN, LIMIT)) == {'coulomb_friction'}
    (law,) = one.names
    wider = Hypothesis((replace(law, parameters=3 * law.parameters),))
    of_three = replace(one, at=one.at._replace(fit=replace(one.fit, hypothesis=wider)))
    best = chosen([none, of_three, *others], PLAIN, LIMIT)
    assert names(best) == {'armature', 'bias_torque'}


def regression(truth: dict, seed: int = 0, alike: float = 0.0, **options):
    """Sets of five effects, each a random column; two of them alike and of opposite sign."""
    rng = np.random.default_rng(seed)
    columns = {n: rng.standard_normal((40, 20)) for n in NAMES}
    shared = columns['armature']
    columns['bias_torque'] = -shared + alike * columns['bias_torque']
    data = rng.standard_normal((40, 20)) + sum(v * columns[n] for n, v in truth.items())
    return Regression(data, columns, posed(FOLD), LIMIT, **options)


def found(estimator: Regression, pool: tuple = NAMES) -> tuple[set, list]:
    sets = Sets(estimator, [wide(POOL[n]) for n in pool], SETTINGS, QUIET)
    best = searched(sets, estimator.first(Hypothesis()), ())
    best = canonical(sets, long_horizon_tie_break(sets, best))
    return names(best), [frozenset(names(s)) for s in resamples(sets)]


@pytest.mark.parametrize(
    'truth',
    [
        {},
        {'armature': 0.5},
        {'coulomb_friction': 0.3, 'viscous_friction': -0.3},
        {'armature': 0.4, 'coulomb_friction': 0.3, 'viscous_friction': -0.3},
    ],
    ids=len,
)
@pytest.mark.parametrize('pairs', [True, False])
def test_what_is_missing_is_found_and_chosen_in_nearly_all_turns(truth, pairs):
    best, turns = found(regression(truth, alike=1.0, pairs=pairs))
    assert best == set(truth)
    assert len(turns) == SETTINGS.gates.turns
    assert turns.count(frozenset(truth)) >= SETTINGS.gates.stable * len(turns)


def test_two_that_hide_each_other_are_found_together():
    truth = {'armature': 2.0, 'bias_torque': 2.0}
    estimator = regression(truth, alike=0.2)
    first = estimator.near(estimator.first(Hypothesis()), [wide(POOL[n]) for n in NAMES], None)
    singles = [e for e in first.larger if len(e.names) == 1]
    assert min(e.fit.loss.sum() for e in singles) > 0.95 * first.base.fit.loss.sum()
    assert found(estimator)[0] == set(truth)


@pytest.mark.parametrize('seed', range(2))
def test_the_order_of_the_candidates_does_not_matter(seed):
    truth = {'armature': 0.15, 'coulomb_friction': 0.3, 'viscous_friction': -0.2}
    estimator = regression(truth, seed, alike=0.5)
    orders = (tuple(np.random.default_rng(s).permutation(NAMES)) for s in range(3))
    answers = [found(estimator, order) for order in orders]
    assert all(best == answers[0][0] for best, _ in answers)
    assert {frozenset(t) for _, t in answers[1:]} == {frozenset(answers[0][1])}


def test_the_order_of_the_recordings_does_not_matter():
    truth = {'armature': 0.4, 'coulomb_friction': 0.3}
    forward = regression(truth, 5, alike=0.5)
    columns = {n: c[::-1] for n, c in forward.columns.items()}
    back = Regression(forward.data[::-1], columns, posed(FOLD), LIMIT)
    assert found(forward)[0] == found(back)[0] == set(truth)


def test_an_effect_stands_beside_no_other_that_holds_it_at_its_place():
    pivot = {n.split(':')[0]: c for n, c in BETWEEN.items() if n.endswith(':all')}
    stribeck, coulomb = pivot['stribeck_friction'], pivot['coulomb_friction']
    assert not compatible([stribeck], coulomb) and not compatible([coulomb], stribeck)
    assert compatible([stribeck], pivot['viscous_friction']) and compatible([], coulomb)
    own = [c for n, c in BETWEEN.items() if n.startswith('coulomb_friction:') and c != coulomb]
    assert len(own) == 2 and compatible([own[0]], own[1])
    assert not compatible([coulomb], own[0]) and not compatible([own[0]], coulomb)


def test_an_effect_stands_beside_no_other_with_a_term_of_its_own():
    laws = 'load_dependent stribeck stribeck_load quadratic_load directional_load'
    load, stribeck, *others = (BETWEEN[f'{name}_friction:all'] for name in laws.split())
    assert all(widens(c, load) and compatible([stribeck], c) for c in others)
    assert not any(compatible([c], d) for c in others for d in (load, *others))


def test_of_two_fits_of_one_set_the_better_is_kept():
    estimator = regression({'armature': 0.5}, alike=1.0)
    sets = Sets(estimator, [], SETTINGS, QUIET)
    hypothesis = Hypothesis((wide(POOL['armature']),))
    good = estimator.refitted(estimator.first(Hypothesis()), hypothesis)
    for order in ((good, unfinished(good)), (unfinished(good), good)):
        sets.known.clear()
        sets.add(order)
        (kept,) = sets.known.values()
        assert kept.at is good


def test_a_search_whose_time_is_over_goes_no_further():
    estimator = regression({'armature': 0.5, 'coulomb_friction': 0.3}, alike=1.0, pairs=False)
    late = Sets(estimator, [wide(POOL[n]) for n in NAMES], SETTINGS, QUIET, until=0.0)
    best = searched(late, estimator.first(Hypothesis()), ())
    late.extensions[frozenset('again')] = late.extensions[frozenset()]
    assert late.late and names(best) == set() and len(late.untried) == len(NAMES)


MUCH = {'none': 80000, 'a': 30000, 'b': 30000, 'c': 5000, 'a_b': 3500}
NOISE = {'none': 8000, 'a': 3000, 'b': 3000, 'c': 2000, 'a_b': 350}


@pytest.mark.parametrize(
    ('nats', 'whole', 'beyond', 'off', 'right'),
    [
        (MUCH, 10.0, 0.5, 0.0, {'coulomb_friction'}),
        (MUCH, 10.0, 1.5, 0.0, {'armature', 'bias_torque'}),
        (MUCH, 1000.0, 3.0, 0.0, {'armature', 'bias_torque'}),
        (MUCH, 1000.0, 3.0, 2.0, {'coulomb_friction'}),
        (NOISE, 10.0, 0.5, 0.0, {'armature', 'bias_torque'}),
    ],
    ids=[
        'alike far ahead',
        'a seventh of it all',
        'little of it all, but seen',
        'less than what is left',
        'nothing left but noise',
    ],
)
def test_two_effects_that_predict_what_one_does_are_no_better_answer(
    nats, whole, beyond, off, right
):
    """Errors far ahead in noise floors; the two save more than the one, no part of them."""
    sets = left(**nats)
    errors = {'': off - whole, 'coulomb_friction': off - beyond, 'armature_bias_torque': off}
    ends = [errors.get('_'.join(sorted(names(s))), -1e4) for s in sets]
    told = [replace(s, ends=np.full((5, 2), e)) for s, e in zip(sets, ends, strict=True)]
    assert names(chosen(told, replace(PLAIN, null=told[0]), LIMIT)) == right


def unfinished(at: Estimate, by: float = 1.0) -> Estimate:
    """The estimate with a fit that rests in a worse place, by so many nats in each window."""
    return at._replace(fit=replace(at.fit, loss=at.fit.loss + by))


def test_a_set_that_is_fitted_better_is_carried_on_anew():
    estimator = regression({'armature': 0.5, 'coulomb_friction': 0.3}, alike=1.0)
    both = Hypothesis(tuple(wide(POOL[n]) for n in ('armature', 'coulomb_friction')))
    good = estimator.refitted(estimator.first(Hypothesis()), both)
    sets = Sets(estimator, [], SETTINGS, QUIET)
    for at, new in ((unfinished(good), True), (unfinished(good), False), (good, True)):
        sets.add([at])
        assert (not sets.carried) == new
        sets.add_parts(sets.known[at.names])
        assert {near for _, near in sets.carried} == {at.names}
