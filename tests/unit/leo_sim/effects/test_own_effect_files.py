# SPDX-License-Identifier: Apache-2.0
"""Effects in a user's file that cannot be used as they are."""

import pytest

from leo_msgs_py.errors import UserError
from leo_sim.effects import get_effect

HOSE = """\
import numpy as np
from leo_sim.effects import Effect, Parameter

class Hose(Effect):
    name, family, hook = 'hose', 'x', 'torque'
    parameters = (Parameter('k', 'N m/rad'), Parameter('slack', 'rad'))

    def torque(self, p, q, dq, motor, load):
        return -p['k'] * q
"""


@pytest.mark.parametrize(
    ('law', 'said'),
    [
        ("-0.1 - p['k'] * q", 'hose gives a torque of 0.1 N m with its neutral values'),
        ("-p['k'] * np.sqrt(q - p['slack'])", 'hose gives a torque of nan N m'),
    ],
)
def test_a_law_that_is_not_off_at_its_neutral_values_is_refused(law, said, tmp_path):
    file = tmp_path / 'hose.py'
    file.write_text(HOSE.replace("-p['k'] * q", law))
    with pytest.raises(UserError, match=said):
        get_effect(str(file))


def test_a_name_of_the_catalogue_is_refused(tmp_path):
    file = tmp_path / 'hose.py'
    file.write_text(HOSE.replace("'hose'", "'viscous_friction'"))
    with pytest.raises(UserError, match='the catalogue has an effect viscous_friction'):
        get_effect(str(file))


def test_a_law_that_needs_two_joints_is_taken(tmp_path):
    file = tmp_path / 'hose.py'
    file.write_text(HOSE.replace("-p['k'] * q", "-p['k'] * (q - q[..., [1, 0]])"))
    assert get_effect(str(file)).name == 'hose'
