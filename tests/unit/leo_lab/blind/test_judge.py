# SPDX-License-Identifier: Apache-2.0
"""How the answers to blind cases are judged and counted."""

import numpy as np
import pytest
from tests.judging import row, truth_of, verdict

from leo_lab.blind.case import KINDS
from leo_lab.blind.parameters import parameter_errors
from leo_lab.blind.table import confusion, summary
from leo_lab.verbs.blind_told import TITLES, WORDS
from leo_sim.description.robot import load_robot
from leo_sim.effects import place

VISCOUS = ('viscous_friction', 'pivot', 'friction')
SCALE = ('voltage_scale', 'pivot', 'command')
SHOULDER = ('viscous_friction', 'shoulder', 'friction')


def pivot(name, **others):
    """A row at the pivot, and how far from it are the others it may be confused with there."""
    return row(name, 'pivot', *((other, 'pivot', apart) for other, apart in others.items()))


@pytest.mark.parametrize(
    ('said', 'found', 'right', 'family'),
    [
        ('named', pivot('viscous_friction'), True, True),
        ('named', pivot('back_emf_scale', viscous_friction=0.0), True, True),
        ('named', pivot('coulomb_friction'), False, True),
        ('unknown', pivot('viscous_friction'), False, False),
        ('ambiguous', pivot('coulomb_friction', viscous_friction=3.0), True, True),
        ('ambiguous', pivot('coulomb_friction', viscous_friction=7.0), False, True),
        ('ambiguous', pivot('a', b=1.0, c=2.0, viscous_friction=3.0), False, False),
        ('ambiguous', pivot('a', b=1.0, back_emf_scale=2.0, viscous_friction=3.0), True, True),
    ],
)
def test_single_effects(said, found, right, family):
    judged = verdict(truth_of('effect', VISCOUS), said, found)
    assert (judged['right'], judged['family']) == (right, family)


def test_the_joint_must_be_right_too():
    truth = truth_of('effect', SHOULDER, robot='double_pendulum')
    assert verdict(truth, 'named', row('viscous_friction', 'shoulder'))['right']
    for where in ('elbow', 'all'):
        assert not verdict(truth, 'named', row('viscous_friction', where))['right']


def test_no_effect_must_be_fine():
    assert verdict(truth_of('none'), 'fine')['right']
    assert not verdict(truth_of('none'), 'named', row('viscous_friction', 'pivot'))['right']


def test_three_effects_need_a_row_each_in_any_order():
    third = ('armature', 'pivot', 'drive')
    truth = truth_of('triple', VISCOUS, SCALE, third)
    rows = [row(name, where) for name, where, _ in (third, VISCOUS, SCALE)]
    assert verdict(truth, 'named', *rows)['exact']
    assert not verdict(truth, 'named', *rows[:2])['right']
    assert not verdict(truth, 'named', *rows[:2], row('coulomb_friction', 'pivot'))['right']


def test_pairs_need_a_row_each():
    truth = truth_of('pair', VISCOUS, SCALE)
    both = row('viscous_friction', 'pivot'), row('voltage_scale', 'pivot')
    assert verdict(truth, 'named', *both)['exact']
    three = verdict(truth, 'named', *both, row('armature', 'pivot'))
    assert three['right'] and not three['exact']
    assert not verdict(truth, 'named', both[0])['right']


CONFUSED = row('joint_spring', 'pivot', ('link_com', 'bob', 2.0))


@pytest.mark.parametrize(
    ('kind', 'said', 'rows', 'variable', 'right', 'lone'),
    [
        ('cable', 'unknown', (), 'angle', True, False),
        ('cable', 'unknown', (), 'rate', False, False),
        ('cable', 'named', (row('joint_spring', 'pivot'),), None, False, True),
        ('cable', 'named', (row('joint_spring', 'pivot', inclusion=0.7),), None, False, False),
        ('hysteresis', 'unknown', (), 'path', True, False),
        ('hysteresis', 'ambiguous', (pivot('coulomb_friction', backlash=2.0),), None, True, False),
        ('cable', 'ambiguous', (CONFUSED,), None, False, False),
    ],
)
def test_outside_the_catalogue(kind, said, rows, variable, right, lone):
    truth = truth_of('outside', (kind, 'pivot', 'outside'))
    judged = verdict(truth, said, *rows, unknown=variable and {'variable': variable})
    assert (judged['right'], judged['lone']) == (right, lone)


def test_parameters_are_off_by_a_share_of_their_size():
    judged = verdict(truth_of('effect', VISCOUS), 'named', pivot('viscous_friction'))
    off = pytest.approx(0.1)
    assert judged['errors'] == [{'parameter': 'viscous_friction.b', 'error': off, 'inside': True}]


def test_a_ripple_may_be_found_with_the_other_sign():
    robot = load_robot('pendulum')
    values = {'a': 2.0, 'n': 3.0, 'phase': 3.0}
    ripple = place(robot, 'torque_ripple', 'pivot')
    parameters = ripple.effect.parameters_for(robot, ripple.where)
    hidden = {
        'name': 'torque_ripple',
        'parameters': values,
        'neutral': {p.name: p.neutral for p in parameters},
        'units': ripple.units,
    }
    found = {
        'a': {'value': -2.0, 'ci95': [-2.2, -1.8]},
        'n': {'value': 3.0, 'ci95': None},
        'phase': {'value': 3.0 + np.pi - 4 * np.pi, 'ci95': [-7.0, -6.0]},
    }
    errors = parameter_errors(hidden, {'parameters': found})
    assert [e['error'] for e in errors] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert [e['inside'] for e in errors] == [True, None, True]


def test_the_table_counts_what_was_taken_for_what():
    truth = truth_of('effect', VISCOUS)
    rows = [
        verdict(truth, 'named', row('viscous_friction', 'pivot')),
        verdict(truth, 'named', row('coulomb_friction', 'pivot')),
        verdict(truth, 'fine'),
    ]
    taken = {'viscous_friction': 1, 'coulomb_friction': 1, 'fine': 1}
    assert confusion(rows) == {'viscous_friction': taken}
    rates = summary('effect', rows)
    assert (rates['right']['hits'], rates['family']['hits'], rates['cases']) == (1, 2, 3)
    assert rates['intervals']['rate'] == 1.0


OF_THEIR_OWN = ('small', 'pushed')  # kinds with files of tests of their own


@pytest.mark.parametrize('kind', [kind for kind in KINDS if kind not in OF_THEIR_OWN])
def test_every_kind_is_counted_and_has_its_words(kind):
    count = {'none': 0, 'effect': 1, 'pair': 2, 'triple': 3, 'outside': 1, 'strength': 1}[kind]
    hidden = [VISCOUS, SCALE, ('armature', 'pivot', 'drive')][:count]
    rates = summary(kind, [verdict(truth_of(kind, *hidden), 'unknown')])
    shares = {share for share, told in rates.items() if isinstance(told, dict)}
    assert 'right' in shares
    assert shares <= WORDS.keys() and kind in TITLES
