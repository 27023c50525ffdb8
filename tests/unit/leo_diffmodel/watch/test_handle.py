# SPDX-License-Identifier: Apache-2.0
"""Parameters on sliders."""

import pytest

from leo_diffmodel.explain.problem.candidates import candidates, limited
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.watch.handle import Handle
from leo_sim.model import Model

PENDULUM = Model('pendulum')
HANDLES = {
    f'{c.label} {p.name}': Handle.of(p)
    for c in candidates(PENDULUM)
    for p in limited(c, PENDULUM, SETTINGS.grids).parameters
}


@pytest.mark.parametrize('name', HANDLES)
def test_positions_and_values_are_the_same_thing(name):
    handle = HANDLES[name]
    low, high = handle.ends
    assert handle.value(low) == pytest.approx(handle.low, rel=1e-3) or low == 0
    assert handle.value(high) == pytest.approx(handle.high, rel=1e-3) or high == 0
    assert low < high and handle.low <= handle.value(0.0) <= handle.high
    for position in (low, 0.3 * high + 0.7 * low, high):
        value = handle.value(position)
        assert handle.value(handle.position(value)) == pytest.approx(value, rel=1e-3)


def test_what_is_typed_stays_in_the_range_and_keeps_its_digits():
    handle = HANDLES['coulomb_friction:pivot c']
    assert handle.exact(-1.0) == 0.0
    value = 0.123456789 * handle.high
    assert handle.exact(value) == value
    assert HANDLES['torque_ripple:pivot n'].exact(4.4) == 4.0
