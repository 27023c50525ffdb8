# SPDX-License-Identifier: Apache-2.0
"""Which robots of a fleet stand out, and which only differ as all of them do."""

import pytest

from leo_diffmodel.fleet.outliers import Figure, fleet

FRICTION = {'name': 'coulomb_friction', 'where': 'pivot'}


def _answer(c, half=0.01, blind=False, mass=None):
    value = {'c': {'value': c, 'unit': 'N m', 'ci95': [c and c - half, c and c + half]}}
    constant = {'value': mass, 'unit': 'kg', 'ci95': [0.9, 1.1]}
    return {
        'effects': [] if c is None else [FRICTION | {'parameters': value}],
        'constants': {} if mass is None else {'links.bob.mass': constant},
        'hypotheses': [{}],
        'not_testable': [FRICTION] if blind else [],
    }


def _stand_out(*values, off=0.0, **more):
    answers = {str(n): _answer(c, **more) for n, c in enumerate(values)}
    (row,) = fleet(answers, lambda _: off)
    return row['stand_out']


def test_a_value_far_off_a_narrow_fleet_stands_out():
    assert _stand_out(0.1, 0.101, 0.099, 0.1, 0.2, 0.102) == ['4']
    assert _stand_out(0.1, 0.101, 0.099, 0.1, 0.2, 0.102, half=0.15) == []  # nobody knows it
    assert _stand_out(0.1, 0.12, 0.06, 0.15, 0.2, 0.09) == []  # all differ as much
    assert _stand_out(0.1, 0.3) == []  # of two nobody knows which


def test_an_effect_that_is_not_named_is_off_where_the_data_would_have_shown_it():
    assert _stand_out(None, None, 0.1, None) == ['2']
    assert _stand_out(0.1, 0.1, 0.1, None) == ['3']
    unsure = {'effects': [], 'not_sure': _answer(0.1)['effects']}  # beside what is sure
    answers = {n: _answer(0.1) for n in 'abc'} | {'d': _answer(0.1) | unsure}
    assert fleet(answers, lambda _: 0.0)[0]['stand_out'] == []
    answers = {'a': _answer(0.1), 'b': _answer(0.1), 'c': _answer(None, blind=True)}
    assert [*fleet(answers, lambda _: 0.0)[0]['robots']] == ['a', 'b']
    assert [*fleet(answers | {'d': _answer(None)}, lambda _: None)[0]['robots']] == ['a', 'b']


def test_constants_are_figures_and_what_was_not_searched_is_no_robot():
    answers = {str(n): _answer(None, mass=m) for n, m in enumerate((1.0, 1.0, 3.0))}
    answers['3'] = _answer(None) | {'hypotheses': []}
    (row,) = fleet(answers, lambda figure: pytest.fail(str(figure)) if figure.parameter else None)
    assert (row['what'], row['parameter'], row['unit']) == ('links.bob.mass', '', 'kg')
    assert row['robots'].keys() == {'0', '1', '2'} and row['median'] == 1.0
    assert str(Figure('links.bob.mass')) == 'links.bob.mass'
