# SPDX-License-Identifier: Apache-2.0
"""Units: dimensions, conversions and mistakes."""

import math

import pytest

from leo_msgs_py import units
from leo_msgs_py.errors import UserError


@pytest.mark.parametrize(
    'unit, other, same',
    [
        ('V s/rad', 'N m/A', True),
        ('N m s2/rad2', 'kg m2', True),
        ('Nm', 'N m', True),
        ('rad/s', 'rpm', True),
        ('1', 'rad', True),
        ('ohm', 'V/A', True),
        ('kg m^2', 'g cm2', True),
        *(('N m', 'N', False), ('rad', 's', False), ('V', 'A', False), ('kg', 'N', False)),
    ],
)
def test_what_is_the_same_thing_in_other_words(unit, other, same):
    assert units.same_dimension(unit, other) == same


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
