# SPDX-License-Identifier: Apache-2.0
"""Lost packets: counted, borne a few in a row, and no more."""

import pytest

from leo_sim.drivers.base import DriverFault
from leo_sim.drivers.safety import Faults


def test_a_good_period_begins_the_count_anew():
    faults = Faults(patience=2)
    for why in ('lost', 'lost', '', 'lost', 'cut', ''):
        faults.note(why)
    assert (faults.total, faults.in_a_row, faults.last) == (4, 0, 'cut')
    assert (faults.take_new(), faults.take_new()) == (4, 0)


@pytest.mark.parametrize('patience', [0, 3])
def test_more_in_a_row_than_are_borne_end_it(patience):
    faults = Faults(patience)
    for _ in range(patience):
        faults.note('lost')
    with pytest.raises(DriverFault, match=f'{patience + 1} periods in a row failed.*: no answer'):
        faults.note('no answer')
