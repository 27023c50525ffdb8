# SPDX-License-Identifier: Apache-2.0
"""The size of a unit is told by the quantities in it; a unit that has none is refused."""

import pytest

from leo_diffmodel.compare.sizes import UnitSizes
from leo_msgs_py.errors import UserError
from leo_sim.effects import Parameter

SIZES = UnitSizes(
    torque=2.0,
    rate=5.0,
    angle=3.0,
    force=7.0,
    speed=0.5,
    length=0.25,
    inertia=0.1,
    mass=1.5,
    input=12.0,
)


@pytest.mark.parametrize(
    ('unit', 'size'),
    [
        ('', 1.0),
        ('1/turn', 1.0),
        ('N m', 2.0),
        ('N m s/rad', 2 / 5),
        ('N m s2/rad2', 2 / 25),
        ('N m s3/rad3', 2 / 125),
        ('N m/rad', 2 / 3),
        ('1/N m', 1 / 2),
        ('rad/s', 5.0),
        ('rad', 3.0),
        ('kg m2', 0.1),
        ('kg', 1.5),
        ('N', 7.0),
        ('N s/m', 14.0),
        ('N s2/m2', 28.0),
        ('N/m', 28.0),
        ('1/N', 1 / 7),
        ('m', 0.25),
        ('m/s', 0.5),
        ('V', 12.0),
        ('V s/rad', 12 / 5),
    ],
)
def test_a_unit_is_as_large_as_what_is_in_it(unit, size):
    assert SIZES.of(unit) == pytest.approx(size)


def test_without_a_size_the_bounds_say_it_or_it_is_refused():
    assert SIZES.of('A') is None
    assert SIZES.large('fuse', Parameter('i', 'A', low=1.0, high=6.0, neutral=6.0)) == 5.0
    with pytest.raises(UserError, match=r"fuse\.i: .* 'A'\? Give it low and high, or a unit"):
        SIZES.large('fuse', Parameter('i', 'A', low=0.0))
