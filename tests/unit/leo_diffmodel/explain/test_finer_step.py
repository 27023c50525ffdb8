# SPDX-License-Identifier: Apache-2.0
"""A step too long for the motion looks like a torque; it is halved where the data ask for that."""

import pytest
from tests.searched import among
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.explanation import explain
from leo_sim.effects import place
from leo_sim.model import Model

FINE = (1e-4, 1e-3)
OWN = 0.01
FRICTION = place(TORQUE, 'viscous_friction', 'pivot', b=0.02)


@pytest.mark.parametrize(('step', 'noted'), [(2.5e-4, True), (OWN, False)])
def test_the_step_is_that_of_the_data(step, noted, monkeypatch):
    among(monkeypatch, Model(TORQUE), 'viscous_friction', 'coulomb_friction', 'bias_torque')
    data = record(TORQUE, FRICTION, seconds=10, noise=FINE, integration_step=step)
    found = explain([data], Model(TORQUE, integration_step=OWN))
    assert [e['name'] for e in found.effects] == ['viscous_friction']
    assert ('10 ms of the robot are too long' in found.sentence) == noted
