# SPDX-License-Identifier: Apache-2.0
"""Units: dimensions, conversions and mistakes."""

import math

import pytest

from leo_msgs_py import units
from leo_msgs_py.errors import UserError


@pytest.mark.parametrize(
    'unit, other',
    [
        ('V s/rad', 'N m/A'),
        ('N m s2/rad2', 'kg m2'),
        ('Nm', 'N m'),
        ('rad/s', 'rpm'),
        ('1', 'rad'),
        ('ohm', 'V/A'),
        ('kg m^2', 'g cm2'),
    ],
)
def test_the_same_thing_in_other_words(unit, other):
    assert units.same_dimension(unit, other)


@pytest.mark.parametrize('unit, other', [('N m', 'N'), ('rad', 's'), ('V', 'A'), ('kg', 'N')])
def test_different_things(unit, other):
    assert not units.same_dimension(unit, other)


@pytest.mark.parametrize(
    'unit, target, factor',
    [
        ('deg', 'rad', math.pi / 180),
        ('mA', 'A', 1e-3),
        ('ms', 's', 1e-3),
        ('rpm', 'rad/s', 2 * math.pi / 60),
        ('g cm2', 'kg m2', 1e-7),
        ('mN m', 'N m', 1e-3),
        ('%', '1', 0.01),
    ],
)
def test_conversions(unit, target, factor):
    assert units.conversion(unit, target, 'x') == pytest.approx(factor)


def test_a_wrong_unit_names_the_value_and_the_right_one():
    with pytest.raises(UserError, match=r"mass is in 'N'.*'kg'"):
        units.conversion('N', 'kg', 'mass')


@pytest.mark.parametrize('text', ['furlong', 'N m/s/rad', 'm-', 'Nm2x!'])
def test_nonsense_is_refused(text):
    with pytest.raises(UserError, match='unit'):
        units.parse(text)
