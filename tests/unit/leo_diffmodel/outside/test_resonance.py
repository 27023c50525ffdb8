# SPDX-License-Identifier: Apache-2.0
"""A motor that swings against its link shows in the answer to its input; friction does not."""

import numpy as np
import pytest
from tests.elastic import elastic
from tests.simulate import record, TORQUE

from leo_diffmodel.outside.outside import moved_from_outside
from leo_diffmodel.outside.resonance import resonance
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.mark.parametrize('hertz', [6.0, 9.0, 11.5])
def test_the_resonance_of_an_elastic_gear_is_found(hertz):
    log = elastic(hertz)
    assert resonance(log, 0) == pytest.approx(hertz, rel=0.06)
    (told,) = moved_from_outside(log, Model(TORQUE))
    assert told.code == 'unexplained' and 'a resonance at' in told.what


def test_a_rigid_joint_with_friction_and_one_whose_input_asks_nothing_have_none():
    rough = place(TORQUE, 'coulomb_friction', 'pivot', c=0.3)
    assert resonance(record(TORQUE, rough, seconds=30), 0) is None
    assert resonance(record(TORQUE, seconds=30, inputs=np.zeros((3000, 1))), 0) is None
