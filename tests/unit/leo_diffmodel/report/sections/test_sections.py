# SPDX-License-Identifier: Apache-2.0
"""What sections make of hand-made numbers: shares, curves, the words on each hypothesis."""

import pytest

from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.report.sections import budget, decided, horizon, hypotheses, verdict

STATES = [{'name': 'pivot', 'unit': 'rad'}, {'name': 'pivot rate', 'unit': 'rad/s'}]


def ladder(models: dict[str, list[float]], kind: str = 'rmse', seconds: float = 0.5) -> dict:
    """The `errors` of explain.json, by model."""
    rows = [{'model': m, kind: sizes, 'seconds': seconds} for m, sizes in models.items()]
    return {'states': STATES, 'statistic': kind, 'ladder': rows}


def shares(errors: dict) -> dict[str, float]:
    return {p['name']: p['share'] for p in budget.explained(errors).values['parts']}


def test_budget_shares_add_up_and_errors_within_chance_of_the_floor_are_noise():
    models = {'as given': [0.10, 1.0], '+ a:pivot': [0.05, 0.6], '+ b:pivot': [0.02, 0.3]}
    parts = shares(ladder({**models, 'noise floor': [0.01, 0.1]}))
    assert sum(parts.values()) == pytest.approx(1.0)
    assert parts['a:pivot'] == pytest.approx(1 - (0.25 + 0.36) / 2)
    assert parts['noise'] == pytest.approx(0.01)
    parts = shares(ladder({'as given': [0.011, 0.11], 'noise floor': [0.01, 0.1]}))
    assert parts == {'unexplained': 0.0, 'noise': pytest.approx(1.0)}


def test_medians_are_told_where_they_are_what_counts():
    models = {'as given': [0.10, 0.0], '+ a:pivot': [0.05, 0.0], 'noise floor': [0.01, 0.1]}
    errors = ladder(models, 'median', 0.3)
    errors['ladder'] = [{**row, 'rmse': [5.0, 5.0]} for row in errors['ladder']]
    values = budget.explained(errors).values
    assert values['word'] == 'median' and values['rows'][0][1][0].startswith('0.1')
    (line,) = verdict._figures(errors)
    assert '0.3 s ahead the median held-out error is 50 % smaller' in line


def against_horizon(*steps: int) -> dict:
    sizes = {'before': [0.1, 1.0], 'after': [0.01, 0.1], 'noise_floor': [0.01, 0.1]}
    rows = [{'steps': n, 'seconds': 0.03 * n, **sizes} for n in steps]
    return {'states': STATES, 'statistic': 'rmse', 'horizon': rows}


def test_every_state_has_its_floor_and_training_errors_beside_the_held_out_ones():
    section = horizon.held_out(against_horizon(1, 10), repaired=True)
    assert len(section.figures) == len(STATES)
    assert [n for n, _ in section.values['legend']] == ['as given', 'repaired', 'noise floor']
    seen = [{'steps': 1, 'before': [0.1, 1.0], 'after': [0.002, 0.02]}]
    values = horizon.held_out(against_horizon(1, 10), True, seen).values
    models = [f'{n}, {of}' for of in ('held out', 'training') for n in ('as given', 'repaired')]
    assert [name for name, _ in values['legend']] == [*models, 'noise floor']
    assert not values['floor_too_high']


def test_an_answer_is_a_bar_beside_the_other_sets():
    rows = [{'effects': [f'armature:{n}'] if n else [], 'share': 0.1} for n in range(10)]
    values = decided.stability(rows, [], SETTINGS.gates.to_json()).values
    assert [s['mine'] for s in values['sets']] == [True] + 6 * [False]
    assert values['sets'][0]['name'] == 'nothing is missing'
    others = {'name': '4 other sets', 'share': '40 %', 'mine': False}
    assert values['sets'][-1] == {**others, 'width': pytest.approx(40.0)}


def hypothesis(name: str, train: float, held: float | None, near: tuple = ()) -> dict:
    return {
        'name': name,
        'where': 'pivot',
        'parameters': {'c': {'value': 0.1, 'unit': 'N m', 'ci95': [0.09, 0.11]}},
        'gain_train': train,
        'gain_held_out': held,
        'inclusion_probability': 0.97,
        'confusable_with': list(near),
    }


def test_every_hypothesis_has_a_status_in_words():
    same = {'name': 'b', 'where': 'pivot', 'separable_nats': 0.1, 'same_thing': 'both brake'}
    close = {'name': 'c', 'where': 'pivot', 'separable_nats': 2.0, 'same_thing': None}
    named = hypothesis('a', 90.0, 30.0, (same, close))
    gains = {'b': (89.9, 30.0), 'c': (88.0, 30.0), 'd': (50.0, 10.0), 'e': (40.0, -3.0)}
    gains |= {'f': (3.0, 1.0), 'g': (11.0, None), 'h': (99.0, None)}
    tried = [named, *(hypothesis(name, *gain) for name, gain in gains.items())]
    section = hypotheses.section([named], tried, {}, 12.0, 'rms, 0.5 s ahead', SETTINGS.gates)
    assert [r['name'] for r in section.values['more']] == ['f', 'g', 'h']
    rows = [*section.values['rows'], *section.values['more']]
    status = {r['name']: (r['kind'], r['status']) for r in rows}
    assert status['a'] == ('supported', 'supported, but not told apart from its rivals')
    assert status['b'] == ('same', 'the same thing in this data: both brake')
    assert status['c'] == ('rival', 'cannot be ruled out: 2.00 nats behind')
    assert status['d'] == ('out', '60.0 nats behind')
    assert status['e'] == ('out', 'does not hold on held-out data')
    assert status['f'] == ('out', 'gains no more than noise would')
    assert status['g'] == ('out', 'ruled out by the first scan')
    assert status['h'] == ('out', 'fell behind before it was fitted to the end')
    assert next(r for r in rows if r['name'] == 'h')['width'] == 0
    assert [r['near'] for r in rows if r['kind'] == 'out'] == [[]] * 5


def test_what_could_not_be_tested_is_told_once_for_each_reason():
    why = {('a', 'x'): 'no swing', ('b', 'x'): 'no swing', ('a', 'y'): 'no swing'}
    why[('c', 'x')] = 'too slow'
    rows = [{'name': n, 'where': w, 'why': y} for (n, w), y in why.items()]
    first, second = decided.untested(rows).values['rows']
    both = [{'name': 'a', 'where': ['x', 'y']}, {'name': 'b', 'where': ['x']}]
    assert first == {'why': 'no swing', 'effects': both}
    assert second['effects'] == [{'name': 'c', 'where': ['x']}]
