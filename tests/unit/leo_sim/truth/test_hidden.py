# SPDX-License-Identifier: Apache-2.0
"""What a simulated robot hides: nothing, an effect drawn by a seed, or those of a file."""

import pytest

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.truth.hidden import hidden_model

PENDULUM = load_robot('pendulum')


def hidden(**private):
    return hidden_model(PENDULUM, private, 'pybullet', None)


def test_minus_one_hides_nothing_and_less_is_no_seed(tmp_path):
    assert hidden().effects == hidden(hidden_seed=-1).effects == ()
    assert len(hidden(hidden_seed=3, sealed=str(tmp_path / 'sealed')).effects) == 1
    with pytest.raises(UserError, match='hidden_seed takes 0 or more, or -1'):
        hidden(hidden_seed=-3)
