# SPDX-License-Identifier: Apache-2.0
"""The difference model's share of the one-step error."""

from dataclasses import replace

import pytest
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.difference.data import transitions
from leo_diffmodel.difference.fit import fit
from leo_diffmodel.difference.network import RECOMMENDED
from leo_diffmodel.watch.live.renewing import Sharer
from leo_msgs_py.errors import UserError
from leo_sim.effects import place
from leo_sim.model import Model

MODEL = Model('torque_pendulum')
QUIET = (1e-5, 1e-4)
FRICTION = place(TORQUE, 'viscous_friction', 'pivot', b=0.1)


@pytest.fixture(scope='module')
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp('share') / 'bag'
    return read_bag(bag(folder, record(TORQUE, FRICTION, seconds=30, noise=QUIET)), TORQUE)


@pytest.fixture(scope='module')
def fitted(recording):
    config = replace(RECOMMENDED, hidden=(32, 32), epochs=60)
    return fit(transitions([recording], MODEL), MODEL, config)[0]


def test_a_model_that_was_fitted_takes_most_of_the_error(recording, fitted):
    share = Sharer(MODEL).share(fitted.to_bytes(), recording)
    assert share.corrected < 0.7 * share.without
    assert 'takes' in share.words and 'of the one-step error' in share.words


def test_without_weights_and_for_another_robot_there_is_none(recording, fitted):
    assert Sharer(MODEL).share(b'', recording) is None
    other = replace(fitted, robot='pendulum')
    assert Sharer(MODEL).share(other.to_bytes(), recording) is None


def test_weights_that_are_none_are_refused(recording):
    with pytest.raises(UserError):
        Sharer(MODEL).share(b'nothing', recording)
