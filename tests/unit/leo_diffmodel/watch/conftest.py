# SPDX-License-Identifier: Apache-2.0
"""A pendulum with friction that its model lacks, as the live page sees it."""

import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.watch.scene import Scene
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.fixture(scope='session')
def data():
    return record(TORQUE, place(TORQUE, 'coulomb_friction', 'pivot', c=0.2), seconds=16)


@pytest.fixture(scope='session')
def scene(data):
    return Scene.of([data], Model('torque_pendulum'))
